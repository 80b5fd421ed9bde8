"""The noise of the measured velocity: its spectrum above the motion, continued below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.noise.spectral_floor import periodogram
from mrctl.identify.records import Record
from mrctl.measurements.shared_spectra import can_be_shared, rounding_density, shared

Array = NDArray[np.float64]

LOWEST_HZ = 30.0  # above what test rigs move at
HIGHEST_SHARE = 0.45  # of the sample rate
BANDS = 6
QUIETEST = 0.25  # quantile over the records: fast motion in some of them is no noise
STEEPEST = 2.0  # a differentiated signal's spectrum rises with the square of the frequency
TAIL = 4.0  # times what the next bands, continued, let expect of the lowest one
OTHERS = 0.5  # coherence: channels with less in the highest band have noise of their own
ABOVE_ROUNDING = 30.0  # times a column's rounding, which is not shared in any case

# A sensor's low pass, of first order, that back and forth, and of second order (Butterworth's): order, times.
LOW_PASSES = ((1, 1), (1, 2), (2, 1))
PASSED, FEWEST_PASSED = 0.01, 3  # of the lowest band, that a band must hold to show its course; bands
CORNERS, LAST_CORNER = 60, 30.0  # tried, and the last of them, in lowest bands
LIKE_A_LOW_PASS = 0.15  # RMS of the logarithm, by which the bands may miss one's course
BELOW = np.array([0.125, 0.25, 0.5])  # of the lowest band's middle, where the course is continued

# A record of another sensor, on a vehicle say, is louder by as much in each of the highest bands, so many.
SHAPED, ALIKE = 2, 1.5  # largest over least of what it is louder by there; a motion's falls off
LOUDER, LOUDEST = 1.5, 10.0  # in power: less is one sensor's scatter, more no sensor's


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """The power density of the velocity's noise.

    middles (bands): in Hz; density (bands): in (m/s)²/Hz, of the quieter records; rise: its power of the
    frequency below them; louder: by run, times what others have, where that is not 1.
    """

    middles: Array
    density: Array
    rise: float
    louder: Mapping[int, float] = field(default_factory=dict)

    def at(self, f: Array, run: int | None = None) -> Array:
        """The density at frequencies (n) in Hz, of a run if one is named; nothing at 0 Hz."""
        known = np.log(self.middles), np.log(np.maximum(self.density, 1e-300))
        level = np.exp(np.interp(np.log(np.maximum(f, 1e-6)), *known))
        below = f < self.middles[0]
        level[below] = self.density[0] * (f[below] / self.middles[0]) ** self.rise
        level[0] = 0.0
        return np.asarray(level * (1.0 if run is None else self.louder.get(run, 1.0)), dtype=np.float64)


def noise_spectrum(records: Sequence[Record]) -> Spectrum | None:
    """The spectrum of the velocity's noise; None where no record is fast enough to show any."""
    top = HIGHEST_SHARE * min(r.rate_hz / r.finer for r in records)
    if top < 1.2 * LOWEST_HZ:
        return None
    edges = np.geomspace(LOWEST_HZ, top, BANDS + 1)
    each: dict[int, Array] = {}
    for r in records:
        n = len(r)
        density = periodogram(r.velocity_m_s) * (2.0 / r.rate_hz)
        f = np.fft.rfftfreq(n, 1.0 / r.rate_hz)
        bands = [density[(f >= a) & (f < b)] for a, b in pairwise(edges)]
        if all(b.size for b in bands):
            level = [float(np.median(b)) / np.log(2.0) for b in bands]  # of an exponential: its mean
            each[r.run] = np.minimum(level, _unshared(r, edges))
    if not each:
        return None
    density = np.quantile(np.array([*each.values()]), QUIETEST, axis=0)
    if float(density.max()) <= 0.0:
        return None
    louder = {run: by for run, own in each.items() if (by := _louder(own, density)) != 1.0}
    density[0] = min(density[0], _above_a_motion(density))
    middles = np.sqrt(edges[:-1] * edges[1:])
    low = slice(0, BANDS // 2)
    rise = float(np.polyfit(np.log(middles[low]), np.log(np.maximum(density[low], 1e-300)), 1)[0])
    if rise < 0.0:
        middles, density = _behind_a_low_pass(middles, density)
    return Spectrum(middles, density, float(np.clip(rise, 0.0, STEEPEST)), louder)


def _louder(own: Array, usual: Array) -> float:
    """By how much a record's noise (bands) is more than the usual, where what it has is no motion; else 1.

    A motion falls off where noise of the same kind has the same course.
    """
    times = own[-SHAPED:] / np.maximum(usual[-SHAPED:], 1e-300)
    least = float(times.min())
    alike = float(times.max()) < ALIKE * least
    return least if alike and LOUDER < least < LOUDEST else 1.0


def _behind_a_low_pass(middles: Array, density: Array) -> tuple[Array, Array]:
    """The same bands, and below them the noise that a low pass lets more of through, where one shows in them.

    Flat below its corner, and there higher than in the lowest band. A corner below that is a motion's tail.
    """
    seen = density > PASSED * density[0]
    if np.count_nonzero(seen) < FEWEST_PASSED or not seen[:FEWEST_PASSED].all():
        return middles, density
    corners = np.geomspace(middles[0], LAST_CORNER * middles[0], CORNERS)
    fits = []
    for order, times in LOW_PASSES:
        shape = -times * np.log1p((middles[seen] / corners[:, None]) ** (2 * order))
        off = np.log(density[seen]) - shape
        level = off.mean(axis=1)
        misfit = np.sqrt(np.mean((off - level[:, None]) ** 2, axis=1))
        best = int(np.argmin(misfit))
        fits.append((float(misfit[best]), best, float(level[best]), order, times))
    misfit, best, level, order, times = min(fits)
    if misfit > LIKE_A_LOW_PASS or best == 0:
        return middles, density
    below = middles[0] * BELOW
    passed = np.exp(level - times * np.log1p((below / corners[best]) ** (2 * order)))
    return np.concatenate([below, middles]), np.concatenate([np.maximum(passed, density[0]), density])


def _unshared(record: Record, edges: Array) -> Array:
    """The velocity's density (bands) that the stroke knows nothing of, where that is another sensor's.

    Two sensors share the motion, not their noise: what they share in one band is motion where they do not in
    the highest. Where they share that too, one of the channels was made from the other, and all is open:
    then there is no end to it.
    """
    velocity, stroke = (x[:: record.finer] for x in (record.velocity_m_s, record.displacement_m))
    whole = np.full(edges.size - 1, np.inf)
    dt_s = record.finer / record.rate_hz
    if not can_be_shared(velocity, stroke):
        return whole
    f, _, alike, density = shared(np.gradient(stroke, dt_s), velocity, dt_s)
    rounding = rounding_density(velocity, dt_s)
    bands = [(f >= a) & (f < b) for a, b in pairwise(edges)]
    if not all(own.any() for own in bands):
        return whole
    highest = bands[-1]
    if np.median(alike[highest]) > OTHERS or np.median(density[highest]) < ABOVE_ROUNDING * rounding:
        return whole
    # Frequency by frequency: a band has lines of the motion, and between them none.
    return np.array([float(np.median((density * (1.0 - alike))[own])) for own in bands])


def _above_a_motion(density: Array) -> float:
    """The most that the lowest band's noise can be beside the next two (bands); more is a motion's tail."""
    first, second = float(density[1]), float(density[2])
    return TAIL * max(first, second) * max(first / max(second, 1e-300), 1.0)
