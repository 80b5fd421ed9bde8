"""The hysteresis filter as the fit sees it: continuous, stable by construction, unit DC gain.

    H(s) = (d0 + m1 d1 s + m2 d2 s² + m3 d3 s³) / (d0 + d1 s + d2 s² + d3 s³)

The denominator is a product of s + p and s² + (c0 / q) s + c0 with positive p, q, c0 (their logarithms are
the parameters), so every pole is stable. 1 / p and 1 / q are the two factors' delays at low frequency, so
bounds on p and q keep every pole from being slow. All m = 1 is H = 1. Between samples the input is taken as
linear (first-order hold), so the same parameters serve runs of any sample rate, and at one rate every stable
discrete filter of this order with poles right of zero has its continuous twin.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrctl.model.filters import ORDER, Filter

Array = NDArray[np.float64]

SHOWN = 0.02  # of a step: what a pole must add to it
LAG_PAIR_RAD_S = 2.0 * np.pi * 300.0  # where the other poles of a plain lag are out of the way
UNIT_RAD_S = 2.0 * np.pi * 10.0  # s is counted in this unit, so that the parameters are near 1


def parameter_count(order: int) -> int:
    """Parameters of a filter of this order: as many for the poles as for the numerator."""
    return 2 * order


def lag(hz: float) -> Array:
    """Parameters of a third-order filter that is little more than a lag at a frequency in Hz."""
    pair = LAG_PAIR_RAD_S / UNIT_RAD_S
    return np.array(
        [np.log(2.0 * np.pi * hz / UNIT_RAD_S), np.log(0.5 * pair), 2.0 * np.log(pair), 0.1, 0.02, 0.02]
    )


def lag_of_two(delay_s: float) -> Array:
    """Parameters of a third-order filter that is little more than two equal lags of that delay together."""
    pole, pair = 2.0 / (delay_s * UNIT_RAD_S), LAG_PAIR_RAD_S / UNIT_RAD_S
    return np.array([np.log(pair), np.log(0.5 * pole), 2.0 * np.log(pole), 0.02, 0.02, 0.02])


def denominator(log_d: Array) -> Array:
    """Polynomial in s (falling powers) with the factors that the logarithms name."""
    order = log_d.size
    c = np.exp(log_d)
    if order == 0:
        return np.ones(1)
    if order == 1:
        return np.array([1.0, c[0]])
    quadratic = np.array([1.0, c[-1] / c[-2], c[-1]])
    return quadratic if order == 2 else np.convolve([1.0, c[0]], quadratic)


def split_late(theta: Array) -> tuple[Array, float]:
    """A filter whose numerator makes it late, as one that is not, and the delay in s that it had more.

    A zero to the right of the axis is one to its left behind an all-pass, which is a delay at low frequency.
    """
    order = theta.size // 2
    d = np.concatenate([denominator(theta[:order]), [0.0]])[: order + 1] if order else np.ones(1)
    rising = d[::-1]  # d0, d1 s, ...
    roots = np.roots((np.concatenate([[1.0], theta[order:]]) * rising)[::-1])
    late = roots.real > 0.0
    delay = 2.0 * float(np.sum((1.0 / roots[late]).real)) / UNIT_RAD_S
    mirrored = np.where(late, -np.conj(roots), roots)
    numerator = np.real(np.poly(mirrored))[::-1] if roots.size else np.ones(1)
    numerator = np.concatenate([numerator / numerator[0] * rising[0], np.zeros(order + 1)])[: order + 1]
    return np.concatenate([theta[:order], np.maximum(numerator[1:] / rising[1:], 0.0)]), delay


def by_middle(theta: Array) -> Array:
    """The parameters with log c1 of s² + c1 s + c0 in place of log q, or again with log q: c1 q = c0."""
    order = theta.size // 2
    changed = theta.copy()
    if order >= 2:
        changed[order - 2] = theta[order - 1] - theta[order - 2]
    return changed


def paired(theta: Array) -> Array:
    """The same filter, its quadratic factor made of the two real poles that are nearest to each other.

    Which pole stands alone makes no difference to three real ones. But only the two of the quadratic factor
    can become a complex pair: a fit that has the two that want to be one in different factors stops there.
    """
    order = theta.size // 2
    if order != ORDER:
        return theta
    c = np.exp(theta[:order])
    total = c[2] / c[1]
    root = total**2 - 4.0 * c[2]
    if root < 0.0:
        return theta
    fast = 0.5 * (total + np.sqrt(root))
    low, middle, high = sorted((float(c[0]), float(fast), float(c[2] / fast)))
    alone, one, other = (high, low, middle) if middle * middle < low * high else (low, middle, high)
    return np.concatenate([np.log([alone, one * other / (one + other), one * other]), theta[order:]])


def discretise(theta: Array, rate_hz: float) -> tuple[Array, Array]:
    """(b, a), four coefficients each in falling powers of z, of parameters (log d, m) at a rate."""
    b, a = _discretise(tuple(theta.tolist()), float(rate_hz))
    return b.copy(), a.copy()


@lru_cache(maxsize=4096)
def _discretise(theta: tuple[float, ...], rate_hz: float) -> tuple[Array, Array]:
    b, a = np.zeros(ORDER + 1), np.zeros(ORDER + 1)
    _hold(np.array(theta, dtype=np.float64), UNIT_RAD_S / rate_hz, b, a)
    return b, a


def coefficient_slopes(theta: Array, rate_hz: float) -> tuple[Array, Array]:
    """Derivatives of (b, a) by each parameter: two arrays (parameters, 4), not to be changed."""
    return _slopes(tuple(theta.tolist()), float(rate_hz))


@lru_cache(maxsize=256)
def _slopes(theta: tuple[float, ...], rate_hz: float) -> tuple[Array, Array]:
    at = np.array(theta, dtype=np.float64)
    db, da = np.zeros((at.size, ORDER + 1)), np.zeros((at.size, ORDER + 1))
    _differences(at, UNIT_RAD_S / rate_hz, db, da)
    return db, da


@njit(cache=True)
def _differences(theta, step, db, da):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    b1, a1, b0, a0 = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4)
    for k in range(theta.size):
        h = 1e-4 * max(1.0, abs(theta[k]))
        up, down = theta.copy(), theta.copy()
        up[k] += h
        down[k] -= h
        _hold(up, step, b1, a1)
        _hold(down, step, b0, a0)
        db[k], da[k] = (b1 - b0) / (2 * h), (a1 - a0) / (2 * h)


@njit(cache=True)
def _hold(theta, step, b, a):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """First-order hold over one step, in units of the filter's time; fills b and a (4)."""
    order = theta.size // 2
    b[:] = 0.0
    a[:] = 0.0
    b[0] = a[0] = 1.0
    if order == 0:
        return
    c = np.exp(theta[:order])
    den = np.ones(order + 1)  # falling powers
    if order == 1:
        den[1] = c[0]
    elif order == 2:
        den[1], den[2] = c[1] / c[0], c[1]
    else:
        c1 = c[2] / c[1]
        den[1], den[2], den[3] = c[0] + c1, c[0] * c1 + c[2], c[0] * c[2]
    num = den.copy()
    for k in range(order):
        num[k] *= theta[2 * order - 1 - k]
    # Controllable form: the state is the input through 1/den and its derivatives.
    big = np.zeros((order + 2, order + 2))
    for k in range(order - 1):
        big[k, k + 1] = step
    for k in range(order):
        big[order - 1, k] = -den[order - k] * step
    big[order - 1, order] = step
    big[order, order + 1] = 1.0
    e = _exponential(big)
    phi, g1, g2 = e[:order, :order].copy(), e[:order, order].copy(), e[:order, order + 1].copy()
    rest = np.empty(order)
    for k in range(order):
        rest[k] = num[order - k] - num[0] * den[order - k]
    # x' = phi x + (g1 - g2) u + g2 u', carried over to a state without u'.
    gamma = g1 - g2 + phi @ g2
    direct = num[0] + np.dot(rest, g2)
    own = _characteristic(phi)
    fed = _characteristic(phi - np.outer(gamma, rest))
    top, bottom = 0.0, 0.0
    for k in range(order + 1):
        a[k] = own[k]
        b[k] = fed[k] + (direct - 1.0) * own[k]
        top += a[k]
        bottom += b[k]
    for k in range(order + 1):
        b[k] *= top / bottom  # exact unit DC gain, whatever rounding did


@njit(cache=True)
def _exponential(x):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """The exponential of a small matrix: a Taylor series of its 2^-k part, squared k times."""
    size = 0.0
    for row in range(x.shape[0]):
        size = max(size, np.sum(np.abs(x[row])))
    halvings = 0
    while size > 0.25:
        size *= 0.5
        halvings += 1
    x = x / 2.0**halvings
    result = np.eye(x.shape[0])
    term = np.eye(x.shape[0])
    for k in range(1, 15):
        term = term @ x / k
        result += term
    for _ in range(halvings):
        result = result @ result
    return result


@njit(cache=True)
def _characteristic(x):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """Coefficients of det(z - x), falling powers (Faddeev and LeVerrier)."""
    n = x.shape[0]
    result = np.ones(n + 1)
    m = np.eye(n)
    for k in range(1, n + 1):
        am = x @ m
        result[k] = -np.trace(am) / k
        m = am + result[k] * np.eye(n)
    return result


def response(theta: Array, frequencies_hz: Array) -> NDArray[np.complex128]:
    """The continuous filter's frequency response."""
    order = theta.size // 2
    den = denominator(theta[:order])
    num = np.concatenate([theta[order:][::-1], [1.0]]) * den
    s = 2j * np.pi * np.asarray(frequencies_hz) / UNIT_RAD_S
    return np.asarray(np.polyval(num, s) / np.polyval(den, s), dtype=np.complex128)


def slowest_s(theta: Array) -> float:
    """Time constant in s of the slowest pole that shows in the answer to a step; 0 for H = 1."""
    return _slowest_s(tuple(theta.tolist()))


@lru_cache(maxsize=256)
def _slowest_s(theta: tuple[float, ...]) -> float:
    order = len(theta) // 2
    if not order:
        return 0.0
    den = denominator(np.array(theta[:order]))
    num = np.array([*theta[order:][::-1], 1.0]) * den
    poles = np.roots(den)
    steepness = np.polyval(np.polyder(den), poles)
    steepness = np.where(np.abs(steepness) > 1e-12, steepness, 1e-12)
    shown = np.abs(np.polyval(num, poles) / (poles * steepness)) > SHOWN  # a pole that a zero hides is none
    return float(np.max(1.0 / (UNIT_RAD_S * -poles.real[shown]), initial=0.0))


def as_filter(theta: Array, rate_hz: float) -> Filter:
    """The discrete filter at a rate."""
    b, a = discretise(theta, rate_hz)
    return Filter(float(rate_hz), tuple(b.tolist()), tuple(a.tolist()))
