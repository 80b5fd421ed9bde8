"""Looking ahead: a current takes effect after the coil's lag, so it is worked out for the motion by then.

    v(t + lead) = v(t) + lead dv/dt

the slope taken from the samples through a first-order low-pass. Good for leads that are short against the
period of the wheel's motion: 8 ms are 30 degrees of 10 Hz.
"""

from __future__ import annotations

import math

SLOPE_TIME_S = 0.002  # time constant of the low-pass on the slope


class Anticipation:
    """Extrapolates one signal, sample by sample."""

    __slots__ = ("_before", "_gain", "_share", "_slope")

    def __init__(self, lead_s: float, dt_s: float) -> None:
        """lead_s: how far ahead; 0 gives the signal as it is."""
        self._gain = lead_s / dt_s
        self._share = -math.expm1(-dt_s / SLOPE_TIME_S)
        self._before: float | None = None
        self._slope = 0.0

    def step(self, value: float) -> float:
        """The value by then, after this sample."""
        before, slope = self._before, self._slope
        self._before = value
        if before is None:
            return value
        self._slope = slope = slope + self._share * (value - before - slope)
        return value + self._gain * slope
