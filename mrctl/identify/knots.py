"""Where the tables get their knots: at the levels a campaign holds, else where its samples lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrctl.identify.records import Record

Array = NDArray[np.float64]

VELOCITY_KNOTS = 40  # a side; the smoothness penalty decides how many of them are really used
CURRENT_KNOTS = 36
TEMPERATURE_KNOTS = 12
MOST_LEVELS = 16
LEVEL_A = 0.03  # held currents nearer than this are one level
LEVEL_C = 1.5
KNOTS_BETWEEN = 5  # knots between two held levels, where samples lie there
FEWEST_BETWEEN = 20
HELD_SHARE = 0.9  # share of the samples that must sit on levels


@dataclass(frozen=True, slots=True)
class Levels:
    """Knots of one table, and whether the campaign holds each of them (else it passes through)."""

    knots: Array
    held: bool


def held_levels(samples: Sequence[Array], width: float) -> Array | None:
    """The few values at which a signal rests, or None when it does not rest."""
    pooled = np.sort(np.concatenate([s[:: max(1, s.size // 4000)] for s in samples]))
    levels: list[float] = []
    held = 0
    start = 0
    total = pooled.size
    while start < total:
        end = int(np.searchsorted(pooled, pooled[start] + width, side="right"))
        middle = float(np.median(pooled[start:end]))
        inside = slice(
            int(np.searchsorted(pooled, middle - width / 2)),
            int(np.searchsorted(pooled, middle + width / 2, "right")),
        )
        share = (inside.stop - inside.start) / total
        if share >= 0.2 / MOST_LEVELS:
            levels.append(middle)
            held += inside.stop - inside.start
            start = max(inside.stop, end)
        else:
            start = max(end, start + 1)
    if not levels or len(levels) > MOST_LEVELS or held < HELD_SHARE * total:
        return None
    return np.array(levels)


def level_knots(samples: Sequence[Array], width: float, count: int) -> Levels:
    """Knots at held levels, with the ends of the range; else half evenly, half by the samples' density."""
    low = min(float(s.min()) for s in samples)
    high = max(float(s.max()) for s in samples)
    levels = held_levels(samples, width)
    if levels is not None:
        ends = [x for x in (low, high) if np.min(np.abs(levels - x)) > width]
        held = np.sort(np.concatenate([levels, ends]))
        between = _between(samples, held, width, count - held.size)
        return Levels(np.sort(np.concatenate([held, between])), held=not ends and not between.size)
    pooled = np.concatenate([s[:: max(1, s.size // 4000)] for s in samples])
    even = np.linspace(low, high, count // 2 + 1)
    dense = np.quantile(pooled, np.linspace(0.0, 1.0, count - count // 2 + 1))
    return Levels(apart(np.concatenate([even, dense]), (high - low) / (3 * count)), held=False)


def _between(samples: Sequence[Array], levels: Array, width: float, most: int) -> Array:
    """More knots where a few runs pass between the levels that the others hold."""
    pooled = np.concatenate(samples)
    found: list[float] = []
    for low, high in pairwise(levels):
        inside = pooled[(pooled > low + width) & (pooled < high - width)]
        if inside.size < FEWEST_BETWEEN:
            continue
        steps = min(KNOTS_BETWEEN, int((high - low) / (3.0 * width)), most - len(found))
        even = np.linspace(low, high, steps + 2)[1:-1]
        found += [x for x in even if np.min(np.abs(inside - x)) < (high - low) / (steps + 1)]
    return np.array(found)


def filled(knots: Array, step: float) -> Array:
    """The knots with even ones between, where two are further apart than `step`."""
    parts = [np.linspace(a, b, max(2, int(np.ceil((b - a) / step)) + 1))[:-1] for a, b in pairwise(knots)]
    return np.concatenate([*parts, knots[-1:]])


def velocity_knots(records: Sequence[Record], count: int = VELOCITY_KNOTS) -> Array:
    """Symmetric knots over the velocities seen: zero, dense around it, the rest by density."""
    speed = np.concatenate([np.abs(r.velocity_m_s[:: max(1, len(r) // 4000)]) for r in records])
    top = max(float(np.max(np.abs(r.velocity_m_s))) for r in records)
    if top == 0.0:
        return np.array([-1.0, 0.0, 1.0])
    third = count // 3
    even = np.linspace(0.0, top, third + 1)[1:]
    dense = np.quantile(speed, np.linspace(0.0, 1.0, third + 1)[1:])
    near = top * np.geomspace(0.005, 1.0, count - 2 * third)
    side = apart(np.concatenate([[0.0], even, dense, near]), top / (6 * count))[1:]
    return np.concatenate([-side[::-1], [0.0], side])


def apart(values: Array, least: float) -> Array:
    """The values, sorted, without those that crowd the one before; first and last stay."""
    values = np.unique(values)
    kept = [float(values[0])]
    for x in values[1:-1]:
        if x - kept[-1] >= least:
            kept.append(float(x))
    last = float(values[-1])
    if len(kept) > 1 and last - kept[-1] < least:
        kept.pop()
    return np.array([*kept, last]) if last > kept[0] else np.array(kept)


@dataclass(frozen=True, slots=True)
class Located:
    """Where samples lie among knots: the knot below, and the share of the way to the next (n each)."""

    below: NDArray[np.intp]
    share: Array
    count: int

    def values(self, table: Array) -> Array:
        """The table's value at each sample."""
        if self.count == 1:
            return table[self.below]
        out = np.empty(self.below.size)
        _read(self.below, self.share, table, out)
        return out

    def slopes(self, knots: Array, table: Array) -> Array:
        """The table's slope at each sample, 0 outside the knots."""
        if self.count == 1:
            return np.zeros(self.below.size)
        steep = np.diff(table) / np.diff(knots)
        inside = (self.share > 0.0) & (self.share < 1.0)
        return np.where(inside, steep[self.below], 0.0)

    @property
    def span(self) -> tuple[int, int]:
        """The first knot in use, and how many there are from it to the last one."""
        first = int(self.below.min())
        return first, int(self.below.max()) - first + (2 if self.count > 1 else 1)

    def hats(self, weight: Array, factor: int = 1) -> Array:
        """Weight times the hat functions of the knots in use, averaged: (knots of `span`, n // factor)."""
        _, used = self.span
        out = np.empty((used, self.below.size // factor))
        self.fill_hats(weight, factor, out, np.arange(used))
        return out

    def fill_hats(self, weight: Array, factor: int, out: Array, kept: NDArray[np.intp]) -> None:
        """As `hats`, of some knots of the span only, into `out` (kept, n // factor)."""
        first, used = self.span
        rows = np.full(used + 1, -1, dtype=np.intp)
        rows[kept] = np.arange(kept.size)
        _scatter(self.below, self.share, weight, first, factor, rows, out)


@njit(cache=True, nogil=True)
def _read(below, share, table, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    for k in range(below.size):
        low = table[below[k]]
        out[k] = low + share[k] * (table[below[k] + 1] - low)


@njit(cache=True, nogil=True)
def _scatter(below, share, weight, first, factor, rows, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    out[:] = 0.0
    for block in range(out.shape[1]):
        for k in range(block * factor, (block + 1) * factor):
            at = below[k] - first
            by = weight[k] / factor
            low, high = rows[at], rows[at + 1]
            if low >= 0:
                out[low, block] += by * (1.0 - share[k])
            if high >= 0:
                out[high, block] += by * share[k]


def locate(x: Array, knots: Array) -> Located:
    """Where samples lie among knots, clamped to the ends as `interpolate` does."""
    if knots.size == 1:
        return Located(np.zeros(x.size, dtype=np.intp), np.zeros(x.size), 1)
    below = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, knots.size - 2)
    share = np.clip((x - knots[below]) / np.diff(knots)[below], 0.0, 1.0)
    return Located(below, share, knots.size)
