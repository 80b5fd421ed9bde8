"""Sec. 6.2: a third-order IIR filter and a first-order low-pass fitted to the average (Eq. 6.4, 6.5).

The IIR filter has the form of Eq. 6.4: three poles, two zeros, no direct path, gain 1 at 0 Hz (nothing in a
sine tells the gain at 0 Hz, and f has the static force already). Its poles and zeros

    (s + p)(s^2 + 2 z w s + w^2)    and    s^2 + 2 y u s + u^2

are carried to the z plane by exp(s T). All parameters are positive, so that it is stable and has a stable
inverse, and the dampings are 1/2 or more: between the lines of a sine's spectrum nothing would hold
a resonance down, and a damper has none there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from mrctl.identify.paper.response import Complex, Responses, fir_response
from mrctl.model.filters import Filter

Array = NDArray[np.float64]

UNIT_RAD_S = 2.0 * np.pi * 10.0  # so that the parameters are near 1
SLOWEST_SHARE = 0.5  # of the motion's own frequency: below it nothing is seen, and no pole or zero may lie
FASTEST_HZ = 400.0  # nor above this: loops of 500 Hz have to carry them
DAMPING = (0.5, 5.0)
STARTS_HZ = (2.0, 10.0, 50.0)
LINEAR_ITERATIONS = 20
REFINED = 5  # of the starts
FAINT = 1e-8  # power below this share tells nothing


@dataclass(frozen=True, slots=True, eq=False)
class LowerOrder:
    """The fitted filters, and their misfits: root mean square of the complex difference, weighted by power.

    corner_hz: of the low-pass a / (s + a), a / 2 pi.
    """

    iir: Filter
    lowpass: Filter
    corner_hz: float
    misfit_iir: float
    misfit_lowpass: float


def lower_order(found: Responses, rate_hz: float) -> LowerOrder:
    """Fit both filters to the average response, weighted by the power that stands behind each frequency."""
    strong = found.spectrum.power > FAINT * found.spectrum.power.max()
    frequency = found.spectrum.frequency_hz[strong]
    w = np.sqrt(found.spectrum.power[strong])
    target = fir_response(found.fir, frequency, rate_hz)

    def misfit(filter_of: Callable[[Array], Filter]) -> Callable[[Array], Array]:
        def residual(parameters: Array) -> Array:
            away = w * (filter_of(parameters).response(frequency) - target)
            return np.concatenate([away.real, away.imag])

        return residual

    third = misfit(lambda parameters: third_order(parameters, rate_hz))
    first = misfit(lambda parameters: low_pass(float(np.exp(parameters[0])), rate_hz))
    slowest_hz = SLOWEST_SHARE * float(np.clip(frequency[np.argmax(w)], 0.1, 20.0))
    bounds = _bounds(slowest_hz)
    starts = [np.clip(start, *bounds) for start in _starts(frequency, target, w, rate_hz)]
    starts.sort(key=lambda start: float(np.sum(third(start) ** 2)))
    best = min(
        (least_squares(third, s, bounds=bounds) for s in starts[:REFINED]), key=lambda fit: float(fit.cost)
    )
    limits = (np.log(slowest_hz), np.log(FASTEST_HZ))
    corner = min(
        (least_squares(first, np.clip([np.log(hz)], *limits), bounds=limits) for hz in STARTS_HZ),
        key=lambda fit: float(fit.cost),
    )
    corner_hz = float(np.exp(corner.x[0]))
    return LowerOrder(
        iir=third_order(best.x, rate_hz),
        lowpass=low_pass(corner_hz, rate_hz),
        corner_hz=corner_hz,
        misfit_iir=float(np.sqrt(2.0 * best.cost)),
        misfit_lowpass=float(np.sqrt(2.0 * corner.cost)),
    )


def third_order(parameters: Array, rate_hz: float) -> Filter:
    """The filter of log p, log w, log z, log u, log y; p, w and u in UNIT_RAD_S."""
    p, w, z, u, y = np.exp(parameters)
    step = UNIT_RAD_S / rate_hz
    a = np.convolve([1.0, -np.exp(-step * p)], _carried(w, z, step))
    b = _carried(u, y, step)
    return Filter.of(rate_hz, (b * (a.sum() / b.sum())).tolist(), a.tolist())


def _carried(w: float, damping: float, step: float) -> Array:
    """(z - exp(s1 T))(z - exp(s2 T)) of the roots of s^2 + 2 damping w s + w^2."""
    root = np.sqrt(complex(damping**2 - 1.0))
    roots = np.exp(step * w * np.array([-damping - root, -damping + root]))
    return np.asarray(np.poly(roots).real, dtype=np.float64)


def low_pass(corner_hz: float, rate_hz: float) -> Filter:
    """Eq. 6.5, a / (s + a), through Tustin."""
    k = np.pi * corner_hz / rate_hz
    return Filter.of(rate_hz, [k / (1.0 + k), k / (1.0 + k)], [1.0, (k - 1.0) / (k + 1.0)])


def _bounds(slowest_hz: float) -> tuple[Array, Array]:
    slow, fast = (2.0 * np.pi * hz / UNIT_RAD_S for hz in (slowest_hz, FASTEST_HZ))
    return (
        np.log([slow, slow, DAMPING[0], slow, DAMPING[0]]),
        np.log([fast, fast, DAMPING[1], fast, DAMPING[1]]),
    )


def _starts(frequency_hz: Array, target: Complex, w: Array, rate_hz: float) -> list[Array]:
    """Where fits begin: the iterated linear fit, and plain guesses lest that fall into a bad valley."""
    ratios = np.array(STARTS_HZ) * 2.0 * np.pi / UNIT_RAD_S
    guesses = [np.log([p, pole, 1.0, zero, 1.0]) for p, pole, zero in product(ratios, ratios, 1.2 * ratios)]
    return [_linear(frequency_hz, target, w, rate_hz), *guesses]


def _linear(frequency_hz: Array, target: Complex, w: Array, rate_hz: float) -> Array:
    """b(z) / a(z) by linear least squares, divided each time by the last a(z) (Sanathanan and Koerner).

    Poles and zeros that come out unstable are mirrored at the unit circle.
    """
    z = np.exp(2j * np.pi * frequency_hz / rate_hz)
    # In powers of z - 1, small in the band, the columns differ; in powers of z they hardly would.
    u = (z - 1.0) * rate_hz / UNIT_RAD_S
    last = np.ones_like(u)
    c = np.zeros(6)
    for _ in range(LINEAR_ITERATIONS):
        scale = w / np.abs(last)
        columns = np.stack([u**2, u, np.ones_like(u), -target * u**2, -target * u, -target], axis=1)
        matrix = columns * scale[:, None]
        right = target * u**3 * scale
        c = np.linalg.lstsq(
            np.concatenate([matrix.real, matrix.imag]), np.concatenate([right.real, right.imag]), rcond=None
        )[0]
        last = u**3 + c[3] * u**2 + c[4] * u + c[5]
    poles = _stable(np.append(1.0, c[3:]), rate_hz)
    real = int(np.argmin(np.abs(poles.imag)))
    zeros = _stable(c[:3], rate_hz)
    if zeros.size < 2:  # a polynomial of lower degree came out
        zeros = poles[:2]
    return np.concatenate([np.log([-poles[real].real]), _pair(np.delete(poles, real)), _pair(zeros)])


def _stable(polynomial: Array, rate_hz: float) -> Complex:
    """Roots in (z - 1) rate / unit as stable roots in the s plane, in UNIT_RAD_S."""
    z = 1.0 + np.roots(polynomial) * UNIT_RAD_S / rate_hz
    z = np.where(np.abs(z) > 1.0, 1.0 / np.conj(z), z)
    s = np.log(np.where(np.abs(z) < 1e-3, 1e-3, z).astype(complex)) * rate_hz / UNIT_RAD_S
    return np.asarray(np.minimum(s.real, -1e-3) + 1j * s.imag, dtype=np.complex128)


def _pair(roots: Complex) -> Array:
    """Log frequency and log damping of two roots."""
    w = float(np.sqrt(np.abs(np.prod(roots))))
    return np.log([w, max(-float(np.sum(roots.real)) / (2.0 * w), 1e-3)])
