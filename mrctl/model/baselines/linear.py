"""The plain current map: current proportional to the wished force.

    i = i_max |F| / F_max   where F dissipates (F v > 0), else 0

F_max is the damper's largest force at room temperature: f(i_max) at the top of its velocity table, with
h = 1. So the line goes through the origin and through that one point, as one reads it off a data sheet;
it knows neither velocity nor temperature nor hysteresis.
"""

from __future__ import annotations

from collections.abc import Mapping

from mrctl.model.baselines.slew import slewed
from mrctl.model.damper import Damper
from mrctl.model.static_inverse import Reach
from mrctl.model.tables import interpolate


def largest_force_n(damper: Damper) -> float:
    """The damper's largest static force in N at room temperature, over its velocity table and currents."""
    static = damper.static
    return interpolate(damper.current_max_a, static.current_a, static.force_n) * max(map(abs, static.shape))


class LinearMap:
    """One damper's current in proportion to the wished force, sample by sample."""

    __slots__ = ("_current_max_a", "_gain_a_n", "_step_max_a", "current_a", "reach")

    def __init__(self, damper: Damper, dt_s: float, parameters: Mapping[str, float] | None = None) -> None:
        """parameters: force_max_n, the force in N that gets the largest current; 0 takes the damper's."""
        force_max_n = (parameters or {}).get("force_max_n", 0.0) or largest_force_n(damper)
        self._gain_a_n = damper.current_max_a / force_max_n
        self._current_max_a = damper.current_max_a
        self._step_max_a = damper.current_slew_a_s * dt_s
        self.reset()

    def reset(self, force_wish_n: float = 0.0, current_a: float = 0.0) -> None:  # noqa: ARG002  # interface
        """Start anew with this current flowing; the wish leaves no trace in this map."""
        self.current_a = current_a
        self.reach = Reach.WITHIN

    def step(self, force_wish_n: float, velocity_m_s: float, temperature_c: float) -> float:  # noqa: ARG002  # interface
        """The current command in A: within 0 and the largest, within the slew limit of the last."""
        wanted = abs(force_wish_n) * self._gain_a_n if force_wish_n * velocity_m_s > 0.0 else 0.0
        if wanted > self._current_max_a:
            self.reach = Reach.ABOVE
        else:
            self.reach = Reach.BELOW if wanted == 0.0 and force_wish_n != 0.0 else Reach.WITHIN
        self.current_a = slewed(self.current_a, wanted, self._current_max_a, self._step_max_a)
        return self.current_a
