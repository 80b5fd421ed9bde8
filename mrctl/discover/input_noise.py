"""The noise that a model's own inputs bring into its force: no better model would be rid of it.

A measured velocity is noisy, and a damper is steep in it near standstill: behind the hysteresis filter
that noise lies below the frequencies at which a residual shows the force sensor's own. It is read off the
velocity's spectrum above the motion, continued below, drawn anew and sent through the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from mrctl.discover.smoothing import smoothed
from mrctl.discover.spectral_floor import periodogram
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.parallel import in_parallel
from mrctl.identify.records import Record

Array = NDArray[np.float64]

LOWEST_HZ = 30.0  # above what test rigs move at
HIGHEST_SHARE = 0.45  # of the sample rate
BANDS = 6
QUIETEST = 0.25  # quantile over the records: fast motion in some of them is no noise
STEEPEST = 2.0  # a differentiated signal's spectrum rises with the square of the frequency
TAIL = 4.0  # times what the next bands, continued, let expect of the lowest one
SEED = 1
LEAST_QUIETER = 0.02  # of the mean square, for a motion without its noise to be the truer one
CLEAR = 4.0  # times the noise's density: there the motion is
EDGE_WIDTH_HZ, WIENER_WIDTH_HZ = 1.0, 3.0  # over which the spectrum held against the noise's is smoothed
MARGIN, SLOPE = 1.2, 1.3  # of the band's edge: what is kept whole, and where all has gone


Spectrum = tuple[Array, Array, float]


def steadied(fit: JointFit, records: Sequence[Record], spectrum: Spectrum | None) -> list[Record]:
    """The records, the motion of some less what its spectrum says is noise, where the force agrees.

    A damper is steep near standstill: noise there hides what is looked for, and whatever smooths the motion,
    a mount or a delay, would seem to be missing. What moves the damper must not be taken for noise, though:
    so each record is the one of its versions that a model of all fits best. Velocity and acceleration lose
    the same, without phase.
    """
    if spectrum is None:
        return list(records)
    smoother = in_parallel(lambda r: [_steadied(r, share) for share in _shares(r, spectrum)], records)
    versions = [list(records), *map(list, zip(*smoother, strict=True))]
    errors = [[float(np.mean(e * e)) for e in fit.model.on(rs).errors(fit.theta)] for rs in versions]
    found = []
    for n, record in enumerate(records):
        best = min(range(len(versions)), key=lambda k: errors[k][n])
        quieter = errors[best][n] < (1.0 - LEAST_QUIETER) * errors[0][n]
        found.append(versions[best][n] if quieter else record)
    return found


def _shares(record: Record, spectrum: Spectrum) -> list[tuple[Array, Array]]:
    """What may pass of a record's motion, by frequency in Hz: a band with an edge; Wiener's filter."""
    n, rate = len(record), record.rate_hz
    lines = periodogram(record.velocity_m_s) * (2.0 / rate)
    f = np.asarray(np.fft.rfftfreq(n, 1.0 / rate), dtype=np.float64)
    noise = _level(f, *spectrum)

    def density(width_hz: float) -> Array:
        return np.asarray(uniform_filter1d(lines, max(3, round(width_hz * n / rate)), mode="nearest"))

    clear = np.flatnonzero(density(EDGE_WIDTH_HZ) > CLEAR * noise)
    edge = MARGIN * float(f[clear[-1]]) + EDGE_WIDTH_HZ if clear.size else float(f[-1])
    band = np.clip((SLOPE * edge - f) / ((SLOPE - 1.0) * edge), 0.0, 1.0)
    wiener = np.clip(1.0 - noise / np.maximum(density(WIENER_WIDTH_HZ), 1e-300), 0.0, 1.0)
    return [(f, band), (f, wiener)]


def _steadied(record: Record, passed: tuple[Array, Array]) -> Record:
    motion = np.stack([record.velocity_m_s, record.acceleration_m_s2])
    velocity, acceleration = smoothed(motion, record.rate_hz, passed)
    return replace(record, velocity_m_s=velocity, acceleration_m_s2=acceleration, passed=passed)


def input_noise(fit: JointFit, records: Sequence[Record], spectrum: Spectrum | None) -> list[Array]:
    """A drawing of what the velocity's noise makes of the model's force: N at each sample measured.

    spectrum: `noise_spectrum` of the records as they were measured.
    """
    if spectrum is None:
        return [np.zeros(len(r))[:: r.finer] for r in records]
    rng = np.random.default_rng(SEED)
    noisy = [replace(r, velocity_m_s=r.velocity_m_s + _drawn(r, *spectrum, rng)) for r in records]
    plain = fit.model.on(records).predict(fit.theta)
    moved = fit.model.on(noisy).predict(fit.theta)
    return [(a - b)[:: r.finer] for a, b, r in zip(moved, plain, records, strict=True)]


def noise_spectrum(records: Sequence[Record]) -> Spectrum | None:
    """(band middles in Hz, power density in (m/s)²/Hz, rise below them), of the quieter records."""
    top = HIGHEST_SHARE * min(r.rate_hz / r.finer for r in records)
    if top < 1.2 * LOWEST_HZ:
        return None
    edges = np.geomspace(LOWEST_HZ, top, BANDS + 1)
    each = []
    for r in records:
        n = len(r)
        density = periodogram(r.velocity_m_s) * (2.0 / r.rate_hz)
        f = np.fft.rfftfreq(n, 1.0 / r.rate_hz)
        bands = [density[(f >= a) & (f < b)] for a, b in pairwise(edges)]
        if all(b.size for b in bands):
            each.append([float(np.median(b)) / np.log(2.0) for b in bands])  # of an exponential: its mean
    if not each:
        return None
    density = np.quantile(np.array(each), QUIETEST, axis=0)
    if float(density.max()) <= 0.0:
        return None
    density[0] = min(density[0], _above_a_motion(density))
    middles = np.sqrt(edges[:-1] * edges[1:])
    low = slice(0, BANDS // 2)
    rise = float(np.polyfit(np.log(middles[low]), np.log(np.maximum(density[low], 1e-300)), 1)[0])
    return middles, density, float(np.clip(rise, 0.0, STEEPEST))


def _above_a_motion(density: Array) -> float:
    """The most that the lowest band's noise can be beside the next two (bands); more is a motion's tail."""
    first, second = float(density[1]), float(density[2])
    return TAIL * max(first, second) * max(first / max(second, 1e-300), 1.0)


def _level(f: Array, middles: Array, density: Array, rise: float) -> Array:
    """The noise's density in (m/s)²/Hz at frequencies (n) in Hz; nothing at 0 Hz."""
    level = np.exp(
        np.interp(np.log(np.maximum(f, 1e-6)), np.log(middles), np.log(np.maximum(density, 1e-300)))
    )
    below = f < middles[0]
    level[below] = density[0] * (f[below] / middles[0]) ** rise
    level[0] = 0.0
    return np.asarray(level, dtype=np.float64)


def _drawn(record: Record, middles: Array, density: Array, rise: float, rng: np.random.Generator) -> Array:
    """Noise of that density, n samples."""
    n, rate = len(record), record.rate_hz
    f = np.asarray(np.fft.rfftfreq(n, 1.0 / rate), dtype=np.float64)
    level = _level(f, middles, density, rise)
    level[f > 0.5 * rate / record.finer] = 0.0
    if record.passed is not None:
        level *= np.interp(f, *record.passed)  # the noise that passed, and the motion that did not (Wiener)
    size = np.sqrt(0.5 * level * rate * n)
    phase = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
    return np.asarray(np.fft.irfft(size * phase / np.sqrt(2.0), n), dtype=np.float64)
