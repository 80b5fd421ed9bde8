"""Third-order IIR filters: the hysteresis filter H(z) of the model and its inverse.

A filter belongs to the sample rate it was identified at; `resampled` carries it to another rate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ORDER = 3  # the paper's; lower orders are padded with zeros

# The band in which a re-discretised filter must agree, and by how much.
BAND_HZ = 20.0
BAND_GAIN_DB = 0.1
BAND_PHASE_DEG = 0.5
# How soon errors above that band count less, as a power of the frequency: the first that keeps the tolerance.
FOCUSES = (2.0, 3.0, 4.0, 6.0)

Coefficients = tuple[float, float, float, float, float, float, float]  # b0 b1 b2 b3 a1 a2 a3


class FilterError(ValueError):
    """A filter cannot do what is asked: unstable, too long, or not to be carried to a sample rate."""


def iir_step(c: Coefficients, state: list[float], u: float) -> float:
    """One sample through a third-order filter (transposed direct form II); advances `state` (3) in place."""
    b0, b1, b2, b3, a1, a2, a3 = c
    y = b0 * u + state[0]
    state[0] = b1 * u - a1 * y + state[1]
    state[1] = b2 * u - a2 * y + state[2]
    state[2] = b3 * u - a3 * y
    return y


def settled_state(c: Coefficients, u: float) -> list[float]:
    """The state (3) of the filter after a constant input u has lasted for ever."""
    b0, b1, b2, b3, a1, a2, a3 = c
    y = u * (b0 + b1 + b2 + b3) / (1.0 + a1 + a2 + a3)
    s2 = b3 * u - a3 * y
    s1 = b2 * u - a2 * y + s2
    return [b1 * u - a1 * y + s1, s1, s2]


def plain_lag(c: Coefficients) -> Coefficients:
    """A first-order lag that delays slow signals as long as this filter does; none for one that leads.

    It is positive real, so that a loop closed around it and a damper is stable, which H's phase need not be.
    """
    b0, b1, b2, b3, a1, a2, a3 = c
    samples = (b1 + 2.0 * b2 + 3.0 * b3) / (b0 + b1 + b2 + b3) - (a1 + 2.0 * a2 + 3.0 * a3) / (
        1.0 + a1 + a2 + a3
    )
    return first_order(max(samples, 0.0))


def first_order(samples: float) -> Coefficients:
    """The lag whose output is `samples` times its last change behind its input (backward Euler)."""
    return (1.0 / (1.0 + samples), 0.0, 0.0, 0.0, -samples / (1.0 + samples), 0.0, 0.0)


def second_order(samples: float, split: float) -> Coefficients:
    """Two such lags in a row that share so many samples: `split` of them the one, the rest the other."""
    one, other = 1.0 / (1.0 + split * samples), 1.0 / (1.0 + (1.0 - split) * samples)
    return (one * other, 0.0, 0.0, 0.0, one + other - 2.0, (1.0 - one) * (1.0 - other), 0.0)


@dataclass(frozen=True, slots=True)
class Filter:
    """A discrete filter b(z)/a(z), both of four coefficients in falling powers of z, a[0] = 1."""

    sample_rate_hz: float
    b: tuple[float, ...]
    a: tuple[float, ...]

    @classmethod
    def of(cls, sample_rate_hz: float, numerator: Sequence[float], denominator: Sequence[float]) -> Filter:
        """The filter numerator/denominator in falling powers of z, right-aligned as printed polynomials are.

        Raises FilterError when it is not proper, not finite, above third order or starts with a zero.
        """
        num, den = [float(x) for x in numerator], [float(x) for x in denominator]
        if not (num and den) or not all(math.isfinite(x) for x in num + den):
            raise FilterError("coefficients must be finite and present")
        if len(den) > ORDER + 1 or den[0] == 0.0:
            raise FilterError(
                f"the denominator has at most {ORDER + 1} coefficients and a non-zero first one"
            )
        if len(num) > len(den):
            raise FilterError(
                "the numerator is longer than the denominator (the filter would need the future)"
            )
        num = [0.0] * (len(den) - len(num)) + num
        pad = [0.0] * (ORDER + 1 - len(den))
        return cls(
            float(sample_rate_hz),
            tuple(x / den[0] for x in num) + tuple(pad),
            tuple(x / den[0] for x in den) + tuple(pad),
        )

    @property
    def coefficients(self) -> Coefficients:
        """b0 b1 b2 b3 a1 a2 a3, as `iir_step` takes them."""
        b0, b1, b2, b3 = self.b
        _, a1, a2, a3 = self.a
        return (b0, b1, b2, b3, a1, a2, a3)

    def poles(self) -> NDArray[np.complex128]:
        """The poles in the z plane; those at the origin that padding adds are left out."""
        return np.asarray(np.roots(np.trim_zeros(np.asarray(self.a), "b")), dtype=np.complex128)

    def is_stable(self) -> bool:
        """Whether all poles lie inside the unit circle."""
        return bool(np.all(np.abs(self.poles()) < 1.0))

    def dc_gain(self) -> float:
        """The gain at 0 Hz."""
        return sum(self.b) / sum(self.a)

    def response(self, frequencies_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        """The complex frequency response, one value a frequency in Hz."""
        z = np.exp(2j * np.pi * np.asarray(frequencies_hz, dtype=np.float64) / self.sample_rate_hz)
        return np.asarray(np.polyval(self.b, z) / np.polyval(self.a, z), dtype=np.complex128)

    def resampled(self, sample_rate_hz: float) -> Filter:
        """The same filter at another sample rate, within 0.1 dB and 0.5 degrees up to 20 Hz.

        Poles are carried over as exp(s T); the numerator is then the least-squares fit to the response
        up to a quarter of the lower rate, weighted to the band as far as the tolerance asks, its DC gain
        exact. A filter with fast real zeros has no faithful Tustin or matched form at 500 Hz, the fitted
        numerator has.
        Raises FilterError when the filter is unstable or the tolerance is missed.
        """
        if not self.is_stable():
            raise FilterError("unstable: a pole lies on or outside the unit circle")
        if sample_rate_hz == self.sample_rate_hz:
            return self
        poles = np.array([_carry_pole(p, self.sample_rate_hz, sample_rate_hz) for p in self.poles()])
        a = np.real(np.poly(poles)) if poles.size else np.ones(1)
        a = np.concatenate([a, np.zeros(ORDER + 1 - a.size)])
        for focus in FOCUSES:
            b = _fit_numerator(self, a, sample_rate_hz, focus)
            result = Filter(float(sample_rate_hz), tuple(b.tolist()), tuple(a.tolist()))
            gain_db, phase_deg = band_difference(result, self)
            if gain_db <= BAND_GAIN_DB and phase_deg <= BAND_PHASE_DEG:
                return result
        raise FilterError(
            f"cannot be carried from {self.sample_rate_hz:g} to {sample_rate_hz:g} Hz: "
            f"off by {gain_db:.2g} dB and {phase_deg:.2g} degrees below {BAND_HZ:g} Hz"
        )


def band_difference(one: Filter, other: Filter, upper_hz: float = BAND_HZ) -> tuple[float, float]:
    """Largest difference of two filters from 0 to upper_hz: (dB, degrees)."""
    f = np.linspace(0.0, upper_hz, 201)
    ratio = one.response(f) / other.response(f)
    gain_db = 20.0 * np.log10(np.abs(ratio))
    return float(np.max(np.abs(gain_db))), float(np.max(np.abs(np.angle(ratio, deg=True))))


def butterworth_lowpass(cutoff_hz: float, sample_rate_hz: float) -> Filter:
    """Second-order Butterworth low-pass, bilinear with its -3 dB point kept at cutoff_hz."""
    k = math.tan(math.pi * cutoff_hz / sample_rate_hz)
    norm = 1.0 + math.sqrt(2.0) * k + k * k
    gain = k * k / norm
    return Filter.of(
        sample_rate_hz,
        (gain, 2.0 * gain, gain),
        (1.0, 2.0 * (k * k - 1.0) / norm, (1.0 - math.sqrt(2.0) * k + k * k) / norm),
    )


def _carry_pole(pole: complex, rate_from_hz: float, rate_to_hz: float) -> complex:
    """A z-plane pole at another rate, by way of the s plane."""
    if abs(pole.imag) < 1e-12 and pole.real <= 1e-9:
        # No real s has exp(s T) negative; Tustin made such poles, so Tustin takes them back.
        s = complex(2.0 * rate_from_hz * (pole.real - 1.0) / (pole.real + 1.0))
    else:
        s = np.log(pole) * rate_from_hz
    return complex(np.exp(s / rate_to_hz))


def _fit_numerator(
    target: Filter, a: NDArray[np.float64], rate_hz: float, focus: float
) -> NDArray[np.float64]:
    """Numerator (4) over `a` that follows the target's response, with its DC gain exactly.

    focus: how soon errors count less above the band, as a power of the frequency.
    """
    upper = min(rate_hz, target.sample_rate_hz) / 4.0
    f = np.concatenate(
        [np.linspace(0.0, 2.0 * BAND_HZ, 160), np.geomspace(2.0 * BAND_HZ, max(upper, 2.5 * BAND_HZ), 60)]
    )
    f = f[f < 0.49 * min(rate_hz, target.sample_rate_hz)]
    weight = 1.0 / (1.0 + (f / BAND_HZ) ** focus)
    z = np.exp(2j * np.pi * f / rate_hz)
    wanted = target.response(f) * np.polyval(a, z)
    powers = z[:, None] ** np.arange(ORDER, -1, -1)[None, :]
    # b3 = dc - b0 - b1 - b2 makes the DC gain exact.
    dc = target.dc_gain() * float(np.sum(a))
    # Errors count by the gain where it is above that at 0 Hz: an inverse filter's rises a hundredfold.
    response = np.abs(target.response(f))
    scale = weight / np.abs(np.polyval(a, z)) / np.maximum(response, response[0])
    matrix = (powers[:, :ORDER] - powers[:, ORDER:]) * scale[:, None]
    right = (wanted - dc * powers[:, ORDER]) * scale
    stacked = np.concatenate([matrix.real, matrix.imag])
    solution = np.linalg.lstsq(stacked, np.concatenate([right.real, right.imag]), rcond=None)[0]
    return np.append(solution, dc - float(np.sum(solution)))
