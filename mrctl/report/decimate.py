"""Long series made short without changing what is seen: extremes per pixel kept, straight runs thinned."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def pieces(*arrays: Floats) -> list[slice]:
    """The stretches in which all arrays are finite; each has at least one point."""
    good = np.all(np.isfinite(np.stack(arrays)), axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], good.astype(np.int8), [0]))))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def extremes(x: Floats, y: Floats, bins: int) -> tuple[Floats, Floats]:
    """At most six points per bin: first, last and the extremes of y (and of x where x turns back).

    Bins are equal steps of x where x never falls (with a bin per pixel a line covers the pixels that it would
    through all points: M4, Jugel et al. 2014), else equal counts of points. Short series come back unchanged.
    """
    count = len(x)
    if count <= 4 * bins:
        return x, y
    rising = bool(np.all(np.diff(x) >= 0)) and x[-1] > x[0]
    if rising:
        bin_of = np.minimum(((x - x[0]) / (x[-1] - x[0]) * bins).astype(np.int64), bins - 1)
    else:
        bin_of = np.arange(count) * bins // count
    starts = np.flatnonzero(np.diff(bin_of, prepend=-1))
    sizes = np.diff(starts, append=count)
    keep = [starts, starts + sizes - 1]
    for values in (y,) if rising else (y, x):
        for extreme in (np.minimum, np.maximum):
            hits = np.flatnonzero(values == np.repeat(extreme.reduceat(values, starts), sizes))
            keep.append(hits[np.flatnonzero(np.diff(bin_of[hits], prepend=-1))])
    chosen = np.unique(np.concatenate(keep))
    return x[chosen], y[chosen]


def straighten(x: Floats, y: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """Drops points that lie within `tolerance` of the line through those kept (Douglas and Peucker)."""
    count = len(x)
    if count < 3:
        return x, y
    keep = np.zeros(count, dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, count - 1)]
    while spans:
        a, b = spans.pop()
        if b - a < 2:
            continue
        px, py = x[a + 1 : b] - x[a], y[a + 1 : b] - y[a]
        dx, dy = x[b] - x[a], y[b] - y[a]
        length_squared = dx * dx + dy * dy
        # Distance to the segment, not to its line: a loop comes back to where it began.
        along = np.clip((px * dx + py * dy) / length_squared, 0.0, 1.0) if length_squared > 0 else 0.0
        distance = np.hypot(px - along * dx, py - along * dy)
        far = int(np.argmax(distance))
        if distance[far] > tolerance:
            middle = a + 1 + far
            keep[middle] = True
            spans += [(a, middle), (middle, b)]
    return x[keep], y[keep]


def thin_cloud(x: Floats, y: Floats, most: int) -> tuple[Floats, Floats]:
    """A scatter of about `most` points: one per cell of a grid as coarse as needed, and the extremes."""
    cell = 0.5
    while len(x) > most:
        columns, rows = np.round(x / cell).astype(np.int64), np.round(y / cell).astype(np.int64)
        _, chosen = np.unique(columns * 1_000_003 + rows, return_index=True)
        ends = [np.argmin(x), np.argmax(x), np.argmin(y), np.argmax(y)]
        kept = np.unique(np.concatenate((chosen, ends)))
        x, y = x[kept], y[kept]
        if len(chosen) <= most:
            break
        cell *= 1.4
    return x, y


def path(x: Floats, y: Floats, *, closed: bool = False) -> str:
    """An SVG path through the points, in relative steps of a tenth of a px."""
    if len(x) == 0:
        return ""
    tenths = np.round(np.stack((x, y), axis=1) * 10).astype(np.int64)
    steps = np.diff(tenths, axis=0)
    steps = steps[np.any(steps != 0, axis=1)]
    start = f"M{_tenth(int(tenths[0, 0]))} {_tenth(int(tenths[0, 1]))}"
    # A minus sign separates numbers as well as a space does.
    moves = " ".join(f"{_tenth(int(dx))} {_tenth(int(dy))}" for dx, dy in steps).replace(" -", "-")
    return start + (f"l{moves}" if moves else "h0") + ("z" if closed else "")


def _tenth(value: int) -> str:
    whole, tenth = divmod(abs(value), 10)
    sign = "-" if value < 0 else ""
    if tenth == 0:
        return f"{sign}{whole}"
    return f"{sign}{whole or ''}.{tenth}"
