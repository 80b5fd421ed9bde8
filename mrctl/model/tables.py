"""Look-up tables: piecewise linear, clamped at both ends, in plain floats.

`interpolate` serves whole runs at the desk, compiled; `make_lookup` gives the same numbers to the tick, to
the last bit, in half the time.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
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


def make_lookup(knots: Sequence[float], values: Sequence[float]) -> Callable[[float], float]:
    """`interpolate` on this table as a function of a finite x alone."""
    knots = tuple(knots)
    # Beyond its ends a table is level: one more segment on either side, without a rise.
    segments = [
        (0.0, values[0], 0.0, 1.0),
        *((x0, y0, y1 - y0, x1 - x0) for (x0, y0), (x1, y1) in pairwise(zip(knots, values, strict=True))),
        (0.0, values[-1], 0.0, 1.0),
    ]

    def lookup(x: float) -> float:
        x0, y0, rise, run = segments[bisect_right(knots, x)]
        return y0 + rise * ((x - x0) / run)

    return lookup


def strictly_increasing(values: Sequence[float]) -> bool:
    """Whether each value is larger than the one before."""
    return all(low < high for low, high in pairwise(values))
