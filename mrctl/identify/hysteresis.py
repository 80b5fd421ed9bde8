"""The hysteresis filter as the fit sees it: continuous, stable by construction, unit DC gain.

    H(s) = (d0 + m1 d1 s + m2 d2 s² + m3 d3 s³) / (d0 + d1 s + d2 s² + d3 s³)

The denominator is a product of s + p and s² + c1 s + c0 with positive p, c1, c0 (their logarithms are the
parameters), so every pole is stable. All m = 1 is H = 1. Between samples the input is taken as linear
(first-order hold), so the same parameters serve runs of any sample rate, and at one rate every stable
discrete filter of this order with poles right of zero has its continuous twin.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter

from mrctl.model.filters import ORDER, Filter

Array = NDArray[np.float64]

UNIT_RAD_S = 2.0 * np.pi * 10.0  # s is counted in this unit, so that the parameters are near 1


def parameter_count(order: int) -> int:
    """Parameters of a filter of this order: as many for the poles as for the numerator."""
    return 2 * order


def denominator(log_d: Array) -> Array:
    """Polynomial in s (falling powers) with the factors that the logarithms name."""
    order = log_d.size
    c = np.exp(log_d)
    if order == 0:
        return np.ones(1)
    if order == 1:
        return np.array([1.0, c[0]])
    quadratic = np.array([1.0, c[-2], c[-1]])
    return quadratic if order == 2 else np.convolve([1.0, c[0]], quadratic)


def discretise(theta: Array, rate_hz: float) -> tuple[Array, Array]:
    """(b, a), four coefficients each in falling powers of z, of parameters (log d, m) at a rate."""
    b, a = _discretise(tuple(theta.tolist()), rate_hz)
    return np.array(b), np.array(a)


@lru_cache(maxsize=4096)
def _discretise(theta: tuple[float, ...], rate_hz: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    order = len(theta) // 2
    if order == 0:
        return (1.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    den = denominator(np.array(theta[:order]))
    m = np.concatenate([np.array(theta[order:])[::-1], [1.0]])  # falling powers, the constant's is 1
    num = m * den
    through = num[0]
    rest = num[1:] - through * den[1:]
    # Controllable form: the state is the input through 1/den and its derivatives.
    step = UNIT_RAD_S / rate_hz
    big = np.zeros((order + 2, order + 2))
    big[: order - 1, 1:order] = np.eye(order - 1) * step
    big[order - 1, :order] = -den[1:][::-1] * step
    big[order - 1, order] = step
    big[order, order + 1] = 1.0
    e = expm(big)
    phi, g1, g2 = e[:order, :order], e[:order, order], e[:order, order + 1]
    # First-order hold: x' = phi x + (g1 - g2) u + g2 u', carried over to a state without u'.
    gamma = g1 - g2 + phi @ g2
    c = rest[::-1]
    direct = through + float(c @ g2)
    a = np.real(np.poly(phi))
    b = np.real(np.poly(phi - np.outer(gamma, c))) + (direct - 1.0) * a
    b *= a.sum() / b.sum()  # exact unit DC gain, whatever rounding did
    pad = [0.0] * (ORDER - order)
    return (*b.tolist(), *pad), (*a.tolist(), *pad)


def coefficient_slopes(theta: Array, rate_hz: float) -> tuple[Array, Array]:
    """Derivatives of (b, a) by each parameter: two arrays (parameters, 4)."""
    db, da = np.zeros((theta.size, ORDER + 1)), np.zeros((theta.size, ORDER + 1))
    for k in range(theta.size):
        h = 1e-5 * max(1.0, abs(theta[k]))
        up, down = theta.copy(), theta.copy()
        up[k] += h
        down[k] -= h
        b1, a1 = discretise(up, rate_hz)
        b0, a0 = discretise(down, rate_hz)
        db[k], da[k] = (b1 - b0) / (2 * h), (a1 - a0) / (2 * h)
    return db, da


def filtered(b: Array, a: Array, u: Array) -> Array:
    """U (..., n) through b/a along the last axis, from the state that u's first value leads to."""
    if not np.any(b[1:]) and not np.any(a[1:]):
        return np.asarray(u * b[0], dtype=np.float64)
    zi = settled_states(b, a, u[..., 0])
    return np.asarray(lfilter(b, a, u, axis=-1, zi=zi)[0], dtype=np.float64)


def settled_states(b: Array, a: Array, first: Array | float) -> Array:
    """Lfilter's states (..., 3) after an endless constant input."""
    gain = b.sum() / a.sum()
    s2 = b[3] - a[3] * gain
    s1 = b[2] - a[2] * gain + s2
    s0 = b[1] - a[1] * gain + s1
    return np.asarray(np.asarray(first)[..., None] * np.array([s0, s1, s2]), dtype=np.float64)


def sensitivities(theta: Array, rate_hz: float, u: Array, y: Array) -> Array:
    """Derivatives of y = H u by each filter parameter: (parameters, n)."""
    if theta.size == 0:
        return np.zeros((0, u.size))
    _, a = discretise(theta, rate_hz)
    db, da = coefficient_slopes(theta, rate_hz)
    one = np.array([1.0, 0.0, 0.0, 0.0])
    both = filtered(one, a, np.stack([u, y]))
    result = np.zeros((theta.size, u.size))
    for k in range(ORDER + 1):
        delayed = (
            both if k == 0 else np.concatenate([np.repeat(both[:, :1], k, axis=1), both[:, :-k]], axis=1)
        )
        result += np.outer(db[:, k], delayed[0]) - np.outer(da[:, k], delayed[1])
    return result


def response(theta: Array, frequencies_hz: Array) -> NDArray[np.complex128]:
    """The continuous filter's frequency response."""
    order = theta.size // 2
    den = denominator(theta[:order])
    num = np.concatenate([theta[order:][::-1], [1.0]]) * den
    s = 2j * np.pi * np.asarray(frequencies_hz) / UNIT_RAD_S
    return np.asarray(np.polyval(num, s) / np.polyval(den, s), dtype=np.complex128)


def slowest_s(theta: Array) -> float:
    """Time constant in s of the slowest pole; 0 for H = 1."""
    order = theta.size // 2
    if order == 0:
        return 0.0
    return float(1.0 / (UNIT_RAD_S * np.min(-np.roots(denominator(theta[:order])).real)))


def as_filter(theta: Array, rate_hz: float) -> Filter:
    """The discrete filter at a rate."""
    b, a = discretise(theta, rate_hz)
    return Filter(float(rate_hz), tuple(b.tolist()), tuple(a.tolist()))
