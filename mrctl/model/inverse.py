"""The inverse model: from a desired force to the coil current that makes it (Eq. 8.1).

    desired force -> inverse filter, refined -> static inverse -> authority weighting -> slew limit -> current

Authority weighting: near zero velocity g vanishes, the current has no authority over the force, and the
exact inverse jumps between no current and the largest one (the paper's current spikes, Fig. 9.6). The
current therefore follows the exact answer at a rate that grows with g squared: at once where the current
matters, not at all where it cannot.
"""

from __future__ import annotations

from math import expm1

from mrctl.model.damper import Damper
from mrctl.model.filters import butterworth_lowpass
from mrctl.model.refined import make_refined_inverse
from mrctl.model.static_inverse import Reach, StaticInverter
from mrctl.model.tables import make_lookup

# The shape |g| at which the current follows with the time constant below; at |g| = 1 it is 11 times faster.
AUTHORITY_SHAPE = 0.3
AUTHORITY_TIME_S = 0.001

# The static inverse is worked out anew when the temperature has moved so far: at most 0.01 % of the force.
TEMPERATURE_STEP_C = 0.01


class InverseModel:
    """One damper's current command, sample by sample, at a fixed step."""

    __slots__ = (
        "_fade",
        "_invert",
        "_inverter",
        "_on",
        "_on_above_a",
        "_settle",
        "_shape_at",
        "_step_max_a",
        "_temperature_c",
        "backbone_wish",
        "current_a",
        "reach",
    )

    def __init__(self, damper: Damper, dt_s: float) -> None:
        """Raises FilterError when a filter cannot be carried to 1/dt_s."""
        rate_hz = 1.0 / dt_s
        tables, cutoff_hz = damper.static, damper.refine_cutoff_hz
        self._shape_at = make_lookup(tables.velocity_m_s, tables.shape)
        self._on_above_a = tables.on_above_a
        self._temperature_c = tables.temperature_c[0]
        self._inverter = StaticInverter(tables, damper.current_max_a, self._temperature_c)
        self._step_max_a = damper.current_slew_a_s * dt_s
        # From a wish to the static force in N that H turns into it: the refined inverse filter's next sample.
        self.backbone_wish, self._settle = make_refined_inverse(
            damper.inverse_filter.resampled(rate_hz),
            damper.forward_filter.resampled(rate_hz),
            None if cutoff_hz is None else butterworth_lowpass(cutoff_hz, rate_hz),
        )
        self._invert = self._inverter.invert
        self._fade = -dt_s / (AUTHORITY_TIME_S * AUTHORITY_SHAPE**2)
        self.reset()

    def reset(self, force_wish_n: float = 0.0, current_a: float = 0.0) -> None:
        """Take the state that a constant wish leads to, with this current flowing."""
        self._settle(force_wish_n)
        self._on = current_a >= self._on_above_a
        self.current_a = current_a
        self.reach = Reach.WITHIN

    def step(self, force_wish_n: float, velocity_m_s: float, temperature_c: float) -> float:
        """The current command in A: finite, within 0 and the largest, within the slew limit of the last."""
        # exact_current, authority and command, written out: their calls would cost a fifth of the time.
        g = self._shape_at(velocity_m_s)
        back_n = self.backbone_wish(force_wish_n)
        if not -TEMPERATURE_STEP_C <= temperature_c - self._temperature_c <= TEMPERATURE_STEP_C:
            self._warm_to(temperature_c)
        exact_a, self._on, self.reach = self._invert(back_n, g, self._on)
        current_a, limit = self.current_a, self._step_max_a
        wanted_a = current_a - expm1(self._fade * g * g) * (exact_a - current_a)
        change = wanted_a - current_a
        if change > limit:
            change = limit
        elif change < -limit:
            change = -limit
        self.current_a = current_a = current_a + change
        return current_a

    def exact_current(self, back_n: float, g: float, temperature_c: float) -> float:
        """The current in A whose static force is back_n, or comes nearest to it, where the shape is g."""
        if not -TEMPERATURE_STEP_C <= temperature_c - self._temperature_c <= TEMPERATURE_STEP_C:
            self._warm_to(temperature_c)
        current_a, self._on, self.reach = self._invert(back_n, g, self._on)
        return current_a

    def _warm_to(self, temperature_c: float) -> None:
        self._temperature_c = temperature_c
        self._inverter.warm_to(temperature_c)

    def authority(self, g: float) -> float:
        """The share of the way to the exact current that one sample goes where the shape is g."""
        return -expm1(self._fade * g * g)

    def command(self, wanted_a: float) -> float:
        """The next command in A: towards the wanted one, as far as the slew limit allows."""
        current_a, limit = self.current_a, self._step_max_a
        change = wanted_a - current_a
        if change > limit:
            change = limit
        elif change < -limit:
            change = -limit
        self.current_a = current_a = current_a + change
        return current_a
