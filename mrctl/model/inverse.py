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
from mrctl.model.static import Reach, invert_shape
from mrctl.model.tables import interpolate

# The shape |g| at which the current follows with the time constant below; at |g| = 1 it is 11 times faster.
AUTHORITY_SHAPE = 0.3
AUTHORITY_TIME_S = 0.001


class InverseModel:
    """One damper's current command, sample by sample, at a fixed step."""

    __slots__ = (
        "_current_max_a",
        "_force_max_n",
        "_forward",
        "_forward_state",
        "_h_off",
        "_h_on",
        "_inverse",
        "_inverse_state",
        "_lowpass",
        "_lowpass_state",
        "_on",
        "_rate",
        "_refined_state",
        "_static",
        "_step_max_a",
        "_temperature_c",
        "current_a",
        "reach",
    )

    def __init__(self, damper: Damper, dt_s: float) -> None:
        """Raises FilterError when a filter cannot be carried to 1/dt_s."""
        rate_hz = 1.0 / dt_s
        self._static = damper.static
        self._current_max_a = damper.current_max_a
        self._force_max_n = interpolate(damper.current_max_a, damper.static.current_a, damper.static.force_n)
        self._temperature_c = math.nan
        self._h_off = self._h_on = 1.0
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
        static = self._static
        if temperature_c != self._temperature_c:  # it changes far less often than once a tick
            self._temperature_c = temperature_c
            self._h_off = interpolate(temperature_c, static.temperature_c, static.h_off)
            self._h_on = interpolate(temperature_c, static.temperature_c, static.h_on)
        g = interpolate(velocity_m_s, static.velocity_m_s, static.shape)
        exact, self._on, self.reach = invert_shape(
            self.backbone_wish(force_wish_n),
            g,
            self._h_off,
            self._h_on,
            static,
            self._current_max_a,
            self._force_max_n,
            self._on,
        )
        change = -math.expm1(-self._rate * g * g) * (exact - self.current_a)
        limit = self._step_max_a
        self.current_a += limit if change > limit else max(change, -limit)
        return self.current_a
