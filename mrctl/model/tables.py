"""Look-up tables: piecewise linear, clamped at both ends, in plain floats.

The same function serves the tick (tuples) and, compiled, whole runs at the desk (arrays).
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise


def interpolate(x: float, knots: Sequence[float], values: Sequence[float]) -> float:
    """The table's value at x: linear between knots, the end value outside them.

    knots: strictly increasing; values: as many. The inverse of a strictly increasing table is
    `interpolate(y, values, knots)`. A NaN x raises IndexError; callers pass finite numbers.
    """
    if x <= knots[0]:
        return values[0]
    if x >= knots[-1]:
        return values[-1]
    upper = bisect_right(knots, x)
    x0 = knots[upper - 1]
    y0 = values[upper - 1]
    return y0 + (values[upper] - y0) * ((x - x0) / (knots[upper] - x0))


def strictly_increasing(values: Sequence[float]) -> bool:
    """Whether each value is larger than the one before."""
    return all(low < high for low, high in pairwise(values))
