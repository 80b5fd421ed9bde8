"""Records through a discrete filter of third order, many rows at a time, and what its parameters change."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrctl.identify.hysteresis import coefficient_slopes, discretise
from mrctl.simulate.run import whole

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def filtered(b: Array, a: Array, u: Array, starts: Ints | None = None) -> Array:
    """U (n) or (m, n) through b/a along the last axis, from the state that a first value leads to.

    starts: where each of several records begins, and where the last one ends (default: one record).
    """
    if not np.any(b[1:]) and not np.any(a[1:]):
        return np.asarray(u * b[0], dtype=np.float64)
    rows = np.ascontiguousarray(u, dtype=np.float64).reshape(-1, u.shape[-1])
    out = np.empty_like(rows)
    _through(b, a, rows, _starts(starts, u.shape[-1]), out)
    return out.reshape(u.shape)


def filter_rows(b: Array, a: Array, rows: Array, starts: Ints) -> None:
    """`filtered` of many rows (m, n, contiguous) in their own place."""
    if np.any(b[1:]) or np.any(a[1:]):
        _through(b, a, rows, _starts(starts, rows.shape[1]), rows)
    elif b[0] != 1.0:
        rows *= b[0]


def _starts(starts: Ints | None, size: int) -> Ints:
    return whole(size) if starts is None else starts.astype(np.int64, copy=False)


@njit(cache=True, nogil=True, fastmath={"contract"})
def _through(b, a, rows, starts, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """Four rows at a time: the processor then waits for none of them."""
    c = (b[0], b[1], b[2], b[3], a[1], a[2], a[3])
    last = rows.shape[0] - 1
    for m in range(0, last + 1, 4):
        n, o, p = min(m + 1, last), min(m + 2, last), min(m + 3, last)
        for j in range(starts.size - 1):
            first, end = starts[j], starts[j + 1]
            at_m, at_n = _settled(c, rows[m, first]), _settled(c, rows[n, first])
            at_o, at_p = _settled(c, rows[o, first]), _settled(c, rows[p, first])
            for k in range(first, end):
                y_m, at_m = _next(c, rows[m, k], at_m)
                y_n, at_n = _next(c, rows[n, k], at_n)
                y_o, at_o = _next(c, rows[o, k], at_o)
                y_p, at_p = _next(c, rows[p, k], at_p)
                out[m, k], out[n, k], out[o, k], out[p, k] = y_m, y_n, y_o, y_p


@njit(cache=True, nogil=True, fastmath={"contract"})
def _next(c, u, state):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """Transposed direct form II: what comes of one sample, and the state behind it."""
    b0, b1, b2, b3, a1, a2, a3 = c
    s0, s1, s2 = state
    y = b0 * u + s0
    return y, (b1 * u + s1 - a1 * y, b2 * u + s2 - a2 * y, b3 * u - a3 * y)


@njit(cache=True, nogil=True)
def _settled(c, u):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """The state that a value leads to which has lasted for ever."""
    b0, b1, b2, b3, a1, a2, a3 = c
    y = u * ((b0 + b1 + b2 + b3) / (1.0 + a1 + a2 + a3))
    s2 = b3 * u - a3 * y
    s1 = b2 * u - a2 * y + s2
    return b1 * u - a1 * y + s1, s1, s2


def sensitivities(theta: Array, rate_hz: float, u: Array, y: Array, starts: Ints | None = None) -> Array:
    """Derivatives of y = H u by each filter parameter: (parameters, n); `starts` as in `filtered`."""
    if theta.size == 0:
        return np.zeros((0, u.size))
    _, a = discretise(theta, rate_hz)
    db, da = coefficient_slopes(theta, rate_hz)
    where = _starts(starts, u.size)
    both = filtered(np.array([1.0, 0.0, 0.0, 0.0]), a, np.stack([u, y]), where)
    result = np.empty((theta.size, u.size))
    _delayed_sum(db, da, both, where, result)
    return result


@njit(cache=True, nogil=True)
def _delayed_sum(db, da, both, starts, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    for m in range(out.shape[0]):
        for j in range(starts.size - 1):
            first = starts[j]
            for k in range(first, starts[j + 1]):
                total = 0.0
                for d in range(4):
                    at = max(k - d, first)
                    total += db[m, d] * both[0, at] - da[m, d] * both[1, at]
                out[m, k] = total
