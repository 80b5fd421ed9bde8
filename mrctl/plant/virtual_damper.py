"""A damper that does not exist: the forward model behind a coil that lags, and warming as it works.

    tau di/dt = u - i                        tau differs for rising and falling current
    C dT/dt = F v + R i^2 - G (T - T_ambient)

The plant is not clamped as the controller is: beyond the calibration's temperatures h goes on along the line
of its end segments, down to a floor. Beyond the velocity table g holds its end value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from mrctl.model.damper import Damper
from mrctl.model.forward import ForwardModel
from mrctl.model.static import StaticTables, static_tables

COLDEST_C = -60.0
HOTTEST_C = 250.0
H_FLOOR = 0.05  # no fluid is without friction


@dataclass(frozen=True, slots=True)
class PhysicsParameters:
    """Coil and heat of one damper; a monotube damper of a car with a current-controlled driver."""

    coil_rise_s: float = 0.008
    coil_fall_s: float = 0.008
    coil_resistance_ohm: float = 1.2
    heat_capacity_j_k: float = 1800.0
    cooling_w_k: float = 6.0

    def __post_init__(self) -> None:
        """Raises ValueError for a value that no damper has."""
        for item in fields(self):
            value = getattr(self, item.name)
            if not (math.isfinite(value) and value >= 0.0) or (value == 0.0 and "capacity" in item.name):
                raise ValueError(
                    f"{item.name} is {value!r}; give a finite number, 0 or more (capacity above 0)"
                )


class VirtualDamper:
    """Force, coil current and temperature of one damper at a fixed step."""

    __slots__ = (
        "_ambient_c",
        "_dt_s",
        "_fall",
        "_forward",
        "_physics",
        "_rise",
        "current_a",
        "force_n",
        "temperature_c",
    )

    def __init__(
        self,
        damper: Damper,
        dt_s: float,
        temperature_c: float,
        physics: PhysicsParameters | None = None,
        ambient_c: float | None = None,
    ) -> None:
        """At rest, without current, at this temperature; the surroundings are as warm unless ambient_c says.

        Raises FilterError when the damper's filter cannot be carried to 1/dt_s.
        """
        self._physics = physics or PhysicsParameters()
        self._forward = ForwardModel(replace(damper, static=beyond_tables(damper.static)), dt_s)
        self._dt_s = dt_s
        self._rise = _share(dt_s, self._physics.coil_rise_s)
        self._fall = _share(dt_s, self._physics.coil_fall_s)
        self._ambient_c = temperature_c if ambient_c is None else ambient_c
        self.temperature_c = temperature_c
        self.current_a = 0.0
        self.force_n = 0.0

    def step(self, velocity_m_s: float, current_command_a: float) -> float:
        """The force in N at this sample; the coil and the temperature advance by one step."""
        i, p = self.current_a, self._physics
        i += (self._rise if current_command_a > i else self._fall) * (current_command_a - i)
        self.current_a = i
        force = self._forward.step(velocity_m_s, i, self.temperature_c)
        power_w = force * velocity_m_s + p.coil_resistance_ohm * i * i
        loss_w = p.cooling_w_k * (self.temperature_c - self._ambient_c)
        self.temperature_c += self._dt_s * (power_w - loss_w) / p.heat_capacity_j_k
        self.force_n = force
        return force


class Extremes:
    """What the true damper can do: its force had the current always been 0, and always the largest.

    Both go through the same motion, temperature and hysteresis as the damper itself.
    """

    __slots__ = ("_current_max_a", "_firm", "_soft", "firm_n", "soft_n")

    def __init__(self, damper: Damper, dt_s: float) -> None:
        """Raises FilterError when the damper's filter cannot be carried to 1/dt_s."""
        true = replace(damper, static=beyond_tables(damper.static))
        self._soft, self._firm = ForwardModel(true, dt_s), ForwardModel(true, dt_s)
        self._current_max_a = damper.current_max_a
        self.soft_n = self.firm_n = 0.0

    def step(self, velocity_m_s: float, temperature_c: float) -> None:
        """Advance by one sample of motion."""
        self.soft_n = self._soft.step(velocity_m_s, 0.0, temperature_c)
        self.firm_n = self._firm.step(velocity_m_s, self._current_max_a, temperature_c)


def beyond_tables(static: StaticTables) -> StaticTables:
    """The same tables with h continued along its end segments to all temperatures, not below a floor."""
    knots = list(static.temperature_c)
    if len(knots) < 2:
        return static
    both = (static.h_off, static.h_on)
    below = _floor_crossings(knots[0], knots[1], both, (0, 1), COLDEST_C)
    above = _floor_crossings(knots[-1], knots[-2], both, (-1, -2), HOTTEST_C)
    all_knots = sorted({*below, *knots, *above})
    h_off, h_on = ([_continued(T, knots, h) for T in all_knots] for h in both)
    return static_tables(
        static.current_a,
        static.force_n,
        static.velocity_m_s,
        static.shape,
        all_knots,
        h_off,
        h_on,
        static.off_below_a,
        static.on_above_a,
    )


def _share(dt_s: float, time_constant_s: float) -> float:
    """How much of the way to its input a first-order lag goes in one step."""
    return 1.0 if time_constant_s == 0.0 else -math.expm1(-dt_s / time_constant_s)


def _continued(temperature_c: float, knots: Sequence[float], h: Sequence[float]) -> float:
    """H at a temperature: its own value at a knot, the end segment's line outside, not below the floor."""
    if temperature_c in knots:
        return h[knots.index(temperature_c)]
    a, b = (0, 1) if temperature_c < knots[0] else (-1, -2)
    slope = (h[b] - h[a]) / (knots[b] - knots[a])
    return max(min(H_FLOOR, h[a]), h[a] + slope * (temperature_c - knots[a]))


def _floor_crossings(
    end_c: float, inner_c: float, both: tuple[Sequence[float], ...], at: tuple[int, int], far_c: float
) -> list[float]:
    """Temperatures beyond a table's end where a continued h meets the floor, and the far end itself."""
    if (end_c - inner_c) * (far_c - end_c) <= 0.0:
        return []
    crossings = [far_c]
    for h in both:
        slope = (h[at[1]] - h[at[0]]) / (inner_c - end_c)
        if slope != 0.0:
            meets = end_c + (H_FLOOR - h[at[0]]) / slope
            if (meets - end_c) * (far_c - meets) > 0.0:
                crossings.append(meets)
    return crossings
