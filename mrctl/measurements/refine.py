"""Signals between their samples: cubic splines, with nothing heavier than numpy.

Where a reversal takes less than a sample, the force between two samples is not that of their mean motion: a
model is right only at a rate that resolves the damper.
"""

from __future__ import annotations

import numpy as np

from mrctl.measurements.run import FloatArray

FEWEST = 4  # samples of a spline


def refinement(rate_hz: float, least_hz: float) -> int:
    """How many samples have to stand for one, to reach a rate."""
    return max(1, int(np.ceil(least_hz / rate_hz - 1e-9)))


def refined(x: FloatArray, factor: int) -> FloatArray:
    """A cubic spline through x (n) at `factor` times its rate, evenly bent at its ends."""
    if factor == 1 or x.size < FEWEST:
        return straight(x, factor)
    at = _places(x.size, factor)
    bend = _bends(x)
    k = np.minimum(at.astype(np.intp), x.size - 2)
    t = at - k
    left = ((1.0 - t) ** 3 - (1.0 - t)) * bend[k]
    right = (t**3 - t) * bend[k + 1]
    return np.asarray((1.0 - t) * x[k] + t * x[k + 1] + (left + right) / 6.0, dtype=np.float64)


def straight(x: FloatArray, factor: int) -> FloatArray:
    """As `refined`, straight between samples: for what may step."""
    return np.asarray(np.interp(_places(x.size, factor), np.arange(x.size), x), dtype=np.float64)


def _places(n: int, factor: int) -> FloatArray:
    """Where the refined samples lie, in samples."""
    return np.arange((n - 1) * factor + 1) / factor


def _bends(x: FloatArray) -> FloatArray:
    """Second differences of the spline at the samples, by elimination; the outermost as those beside them."""
    right = (6.0 * (x[2:] - 2.0 * x[1:-1] + x[:-2])).tolist()
    count = len(right)
    inner, pivots = [0.0] * count, [5.0]
    for k in range(1, count):
        by = 1.0 / pivots[-1]
        pivots.append((5.0 if k == count - 1 else 4.0) - by)
        right[k] -= by * right[k - 1]
    inner[-1] = right[-1] / pivots[-1]
    for k in range(count - 2, -1, -1):
        inner[k] = (right[k] - inner[k + 1]) / pivots[k]
    return np.array([inner[0], *inner, inner[-1]])
