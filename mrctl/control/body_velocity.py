"""Body velocity where a car only measures body acceleration.

    v / a = s / (s^2 + sqrt(2) w s + w^2)

is 1/s behind a second-order Butterworth high-pass: it integrates above the cutoff and has no gain at
0 Hz, so that neither a biased accelerometer nor gravity on a tilted one makes the velocity drift.
"""

from __future__ import annotations

import cmath
import math

from mrctl.model.filters import Coefficients, iir_step


class BodyVelocityEstimator:
    """Integrates body acceleration with its drift removed, sample by sample."""

    __slots__ = ("_coefficients", "_cutoff_rad_s", "_state")

    def __init__(self, cutoff_hz: float, dt_s: float) -> None:
        """cutoff_hz: below it the velocity fades out; a tenth of the body's lowest frequency is usual.

        Raises ValueError unless 0 < cutoff_hz < 1/(20 dt_s).
        """
        if not 0.0 < cutoff_hz < 0.05 / dt_s:
            raise ValueError(
                f"cutoff {cutoff_hz!r} Hz is outside 0 to {0.05 / dt_s:g} Hz; 0.05 to 0.2 Hz suits a car"
            )
        self._cutoff_rad_s = 2.0 * math.pi * cutoff_hz
        self._coefficients = _integrator(self._cutoff_rad_s, dt_s)
        self._state = [0.0, 0.0, 0.0]

    def reset(self) -> None:
        """Forget the past: velocity 0."""
        self._state = [0.0, 0.0, 0.0]

    def step(self, acceleration_m_s2: float) -> float:
        """The body velocity in m/s, upward positive, after this sample of acceleration."""
        return iir_step(self._coefficients, self._state, acceleration_m_s2)

    def error(self, frequency_hz: float) -> tuple[float, float]:
        """What removing the drift costs at a frequency: gain over the true one, and phase lead in degrees."""
        s, w = 2j * math.pi * frequency_hz, self._cutoff_rad_s
        ratio = s * s / (s * s + math.sqrt(2.0) * w * s + w * w)
        return abs(ratio), math.degrees(cmath.phase(ratio))


def _integrator(cutoff_rad_s: float, dt_s: float) -> Coefficients:
    """Coefficients of s / (s^2 + sqrt(2) w s + w^2) through Tustin's rule."""
    k, w = 2.0 / dt_s, cutoff_rad_s
    middle = math.sqrt(2.0) * w * k
    norm = k * k + middle + w * w
    return (
        k / norm,
        0.0,
        -k / norm,
        0.0,
        2.0 * (w * w - k * k) / norm,
        (k * k - middle + w * w) / norm,
        0.0,
    )
