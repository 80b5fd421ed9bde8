"""Columns of a force that remembers what was before: how long, how far, how fast, at what current."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.signals import turned_m
from mrctl.discover.verdict.course_signals import Columns, Signals, product
from mrctl.identify.filtering import filtered
from mrctl.identify.records import Record

Array = NDArray[np.float64]

FADING = (0.03, 0.1, 0.3, 1.0)  # of all there is: how soon a force has faded
MOMENTS_S = (0.1, 0.3, 1.0, 3.0)  # over which a mean speed is taken
REBUILT_S, BROKEN_M = (1.0, 3.0, 10.0, 30.0), (0.1, 0.3, 1.0)  # of a fluid's structure: time at rest, way
REBUILDS = 0.5  # of the longest record: what takes longer is broken down by the way alone
GRAIN_S = 0.02  # over which that hardly changes
RELAXING_S = (0.01, 0.05, 0.25)  # of a rubber's elements
TURNED_M = (1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3, 3.2e-3)  # ways from a turn to where a force is nearly back, ...
PLACES = (0.0, 0.5, 1.0, 2.0)  # ... and where along them it is asked for: at the last it is back
LEAST_A = 0.1  # that the current must change by, for anything to hang on it


def fading(s: Signals, driver: Callable[[Record, Array], Array]) -> Iterator[Columns]:
    """A force that fades, or recovers, as something of each run adds up."""
    done = s.each(lambda r, f: np.cumsum(driver(r, f)) / r.rate_hz)
    most = max(float(d[-1]) for d in done)
    for share in FADING:
        if most > 0.0:
            yield Columns([[f * np.exp(-d / (share * most)) for f, d in zip(s.forces, done, strict=True)]])


def after_speed(s: Signals) -> Iterator[Columns]:
    """A fluid that thins by the mean speed of the last moments."""
    for moment in MOMENTS_S:
        yield Columns([s.each(lambda r, f, t: f * lagged(np.abs(r.velocity_m_s), t * r.rate_hz), moment)])


def rested(s: Signals) -> Iterator[Columns]:
    """A fluid whose structure motion breaks and time rebuilds (Moore, Trans. Brit. Ceram. Soc. 58 (1959))."""
    longest_s = max(len(r) / r.rate_hz for r in s.records)
    for rebuilt_s in (t for t in REBUILT_S if t < REBUILDS * longest_s):
        for broken_m in BROKEN_M:
            whole = s.each(lambda r, _, *of: _structure(r, *of), rebuilt_s, broken_m)
            yield Columns([product(s.forces, whole)])


def after_current(s: Signals) -> Iterator[Columns]:
    """A coil or a fluid that remembers the current for longer than a lag does."""
    if s.change(lambda r: r.current_a) > LEAST_A:
        for moment in MOMENTS_S:
            yield Columns([s.each(lambda r, f, t: f * lagged(r.current_a, t * r.rate_hz), moment)])


def after_turning(s: Signals) -> Iterator[Columns]:
    """Play, or what stretches: another force up to some way from where the motion turned."""
    if s.moves:
        ways = [np.abs(turned_m(r)) for r in s.records]
        for reach in TURNED_M:
            yield Columns([product(s.forces, [_hat(w / reach, place) for w in ways]) for place in range(3)])


def relaxing(s: Signals) -> Iterator[Columns]:
    """A rubber beside the damper, whose stiffness relaxes."""
    if s.moves:
        yield Columns(
            [
                s.each(lambda r, _, t: r.displacement_m - lagged(r.displacement_m, t * r.rate_hz), time_s)
                for time_s in RELAXING_S
            ]
        )


def _hat(way: Array, place: int) -> Array:
    """1 at one of the places on a way, straight to 0 at those beside it."""
    return np.asarray(np.interp(way, PLACES, np.eye(len(PLACES))[place]))


def _structure(record: Record, rebuilt_s: float, broken_m: float) -> Array:
    """What a record has of a structure, whole at first, that way breaks down and time rebuilds: 0 to 1."""
    size = max(1, round(GRAIN_S * record.rate_hz))
    speed = np.add.reduceat(np.abs(record.velocity_m_s), np.arange(0, len(record), size)) / size
    rate = 1.0 / rebuilt_s + speed / broken_m
    kept, settled = np.exp(-rate * size / record.rate_hz), 1.0 / (rebuilt_s * rate)
    level, found = 1.0, [1.0]
    for keep, end in zip(kept.tolist(), settled.tolist(), strict=True):
        level = end + (level - end) * keep
        found.append(level)
    return np.interp(np.arange(len(record)), size * np.arange(len(found)), found)


def lagged(x: Array, samples: float) -> Array:
    """A first-order lag of so many samples, settled at the first one."""
    keep = float(np.exp(-1.0 / max(samples, 1e-9)))
    return filtered(np.array([1.0 - keep, 0.0, 0.0, 0.0]), np.array([1.0, -keep, 0.0, 0.0]), x)
