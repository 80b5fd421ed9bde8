"""The inverse model: from a desired force to the coil current that makes it (Eq. 8.1).

    desired force -> inverse filter, refined -> static inverse -> authority weighting -> slew limit -> current

Refinement: forward times inverse filter, G, is not quite 1 (up to 0.7 dB and 3 degrees in the paper's
band). What is left, 1 - G, is formed from the wish, low-passed and sent through the inverse filter once
more, which squares the remaining error.

Authority weighting: near zero velocity g vanishes, the current has no authority over the force, and the
exact inverse jumps between no current and the largest one (the paper's current spikes, Fig. 9.6). The
current therefore follows the exact answer at a rate that grows with g squared: at once where the current
matters, not at all where it cannot.
"""

from __future__ import annotations

import math

from mrctl.model.damper import Damper
from mrctl.model.filters import butterworth_lowpass, iir_step, settled_state
from mrctl.model.static_inverse import Reach, StaticInverter
from mrctl.model.tables import interpolate

# The shape |g| at which the current follows with the time constant below; at |g| = 1 it is 11 times faster.
AUTHORITY_SHAPE = 0.3
AUTHORITY_TIME_S = 0.001

# The static inverse is worked out anew when the temperature has moved so far: at most 0.01 % of the force.
TEMPERATURE_STEP_C = 0.01


class InverseModel:
    """One damper's current command, sample by sample, at a fixed step."""

    __slots__ = (
        "_current_max_a",
        "_forward",
        "_forward_state",
        "_inverse",
        "_inverse_state",
        "_inverter",
        "_lowpass",
        "_lowpass_state",
        "_on",
        "_rate",
        "_refined_state",
        "_shape",
        "_static",
        "_step_max_a",
        "_temperature_c",
        "_velocity_m_s",
        "current_a",
        "reach",
    )

    def __init__(self, damper: Damper, dt_s: float) -> None:
        """Raises FilterError when a filter cannot be carried to 1/dt_s."""
        rate_hz = 1.0 / dt_s
        self._static = damper.static
        self._velocity_m_s, self._shape = damper.static.velocity_m_s, damper.static.shape
        self._temperature_c = damper.static.temperature_c[0]
        self._current_max_a = damper.current_max_a
        self._inverter = StaticInverter(damper.static, damper.current_max_a, self._temperature_c)
        self._step_max_a = damper.current_slew_a_s * dt_s
        self._inverse = damper.inverse_filter.resampled(rate_hz).coefficients
        self._forward = damper.forward_filter.resampled(rate_hz).coefficients
        self._lowpass = (
            None
            if damper.refine_cutoff_hz is None
            else butterworth_lowpass(damper.refine_cutoff_hz, rate_hz).coefficients
        )
        self._rate = dt_s / (AUTHORITY_TIME_S * AUTHORITY_SHAPE**2)
        self.reset()

    def reset(self, force_wish_n: float = 0.0, current_a: float = 0.0) -> None:
        """Take the state that a constant wish leads to, with this current flowing."""
        self._inverse_state = settled_state(self._inverse, force_wish_n)
        self._forward_state = settled_state(self._forward, force_wish_n)
        self._lowpass_state = [0.0, 0.0, 0.0]
        self._refined_state = [0.0, 0.0, 0.0]
        self._on = current_a >= self._static.on_above_a
        self.current_a = current_a
        self.reach = Reach.WITHIN

    def backbone_wish(self, force_wish_n: float) -> float:
        """The static force in N that H turns into the wish: the refined inverse filter's next sample."""
        back = iir_step(self._inverse, self._inverse_state, force_wish_n)
        if self._lowpass is None:
            return back
        missing = force_wish_n - iir_step(self._forward, self._forward_state, back)
        missing = iir_step(self._lowpass, self._lowpass_state, missing)
        return back + iir_step(self._inverse, self._refined_state, missing)

    def step(self, force_wish_n: float, velocity_m_s: float, temperature_c: float) -> float:
        """The current command in A: finite, within 0 and the largest, within the slew limit of the last."""
        g = interpolate(velocity_m_s, self._velocity_m_s, self._shape)
        exact = self.exact_current(self.backbone_wish(force_wish_n), g, temperature_c)
        return self.command(self.current_a + self.authority(g) * (exact - self.current_a))

    def exact_current(self, back_n: float, g: float, temperature_c: float) -> float:
        """The current in A whose static force is back_n, or comes nearest to it, where the shape is g."""
        if not -TEMPERATURE_STEP_C <= temperature_c - self._temperature_c <= TEMPERATURE_STEP_C:
            self._temperature_c = temperature_c
            self._inverter.warm_to(temperature_c)
        current_a, self._on, self.reach = self._inverter.invert(back_n, g, self._on)
        return current_a

    def authority(self, g: float) -> float:
        """The share of the way to the exact current that one sample goes where the shape is g."""
        return -math.expm1(-self._rate * g * g)

    def command(self, wanted_a: float) -> float:
        """The next command in A: towards the wanted one, as far as the slew limit allows."""
        change = wanted_a - self.current_a
        limit = self._step_max_a
        self.current_a += limit if change > limit else max(change, -limit)
        return self.current_a
