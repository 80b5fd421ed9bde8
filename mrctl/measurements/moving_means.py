"""Moving means over any number of samples, as a logger that averages stores a channel."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def smoothed(x: Array, samples: float) -> Array:
    """Means of x (..., n) over any number of samples around each; x is linear between them, held outside."""
    if samples <= 1.0:
        return x
    rows = np.ascontiguousarray(x, dtype=np.float64).reshape(-1, x.shape[-1])
    out = np.empty_like(rows)
    whole = int(samples / 2)
    rest = samples / 2 - whole
    beyond = 0.5 * rest**2  # areas of the outermost hat functions under the window
    if whole:
        _loop()(rows, whole, beyond, 0.5 + rest - beyond, samples, out)
    else:
        _loop()(rows, 1, 0.0, beyond, samples, out)
        out += (2.0 * (rest - beyond) - 1.0) / samples * rows  # the middle is not in it as a whole
    return out.reshape(x.shape)


@cache
def _loop() -> Callable[..., Any]:
    """`running_means`, compiled where numba is: a fit takes many, and a reader of files few."""
    try:
        from numba import njit  # noqa: PLC0415 - a plain installation does without it
    except ImportError:
        return running_means
    return njit(nogil=True, cache=True)(running_means)


def running_means(rows: Array, whole: int, farther: float, far: float, samples: float, out: Array) -> None:
    """Into `out` (m, n) the sums that run along `rows` (m, n), divided by `samples`.

    2 `whole` - 1 samples count as they are, on each side the next by `far` and the one after by `farther`.
    """
    last = rows.shape[1] - 1
    for m in range(rows.shape[0]):
        x, y = rows[m], out[m]
        inner = 0.0
        for k in range(1 - whole, whole):
            inner += x[min(max(k, 0), last)]
        for k in range(last + 1):
            before, after = x[max(k - whole, 0)], x[min(k + whole, last)]
            outer = x[max(k - whole - 1, 0)] + x[min(k + whole + 1, last)]
            y[k] = (farther * outer + far * (before + after) + inner) / samples
            inner += after - x[max(k - whole + 1, 0)]
