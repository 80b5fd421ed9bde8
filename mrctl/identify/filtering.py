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


@njit(cache=True, nogil=True)
def _through(b, a, rows, starts, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """Transposed direct form II, two rows at a time: the processor then waits for neither of them."""
    gain = (b[0] + b[1] + b[2] + b[3]) / (a[0] + a[1] + a[2] + a[3])
    b0, b1, b2, b3, a1, a2, a3 = b[0], b[1], b[2], b[3], a[1], a[2], a[3]
    c2 = b3 - a3 * gain
    c1 = b2 - a2 * gain + c2
    c0 = b1 - a1 * gain + c1
    count = rows.shape[0]
    for m in range(0, count, 2):
        x, y = rows[m], out[m]
        other = min(m + 1, count - 1)
        p, q = rows[other], out[other]
        for j in range(starts.size - 1):
            first = starts[j]
            s0, s1, s2 = c0 * x[first], c1 * x[first], c2 * x[first]
            r0, r1, r2 = c0 * p[first], c1 * p[first], c2 * p[first]
            for k in range(first, starts[j + 1]):
                u, v = x[k], p[k]
                w = b0 * u + s0
                z = b0 * v + r0
                s0 = b1 * u - a1 * w + s1
                r0 = b1 * v - a1 * z + r1
                s1 = b2 * u - a2 * w + s2
                r1 = b2 * v - a2 * z + r2
                s2 = b3 * u - a3 * w
                r2 = b3 * v - a3 * z
                y[k] = w
                q[k] = z


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
