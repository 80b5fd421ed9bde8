"""The noise that a model's own inputs bring into its force: no better model would be rid of it.

A measured velocity is noisy, and a damper is steep in it near standstill: behind the hysteresis filter
that noise lies below the frequencies at which a residual shows the force sensor's own. As `motion_noise` has
it, it is drawn anew and sent through the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from mrctl.discover.noise.motion_noise import Spectrum
from mrctl.discover.noise.smoothing import smoothed
from mrctl.discover.noise.spectral_floor import periodogram
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.parallel import in_parallel
from mrctl.identify.records import Record

Array = NDArray[np.float64]

SEED = 1
LEAST_QUIETER = 0.02  # of the mean square, for a motion without its noise to be the truer one
CLEAR = 4.0  # times the noise's density: there the motion is
EDGE_WIDTH_HZ, WIENER_WIDTH_HZ = 1.0, 3.0  # over which the spectrum held against the noise's is smoothed
SLIGHTLY = 1e-3  # of the largest speed, by which a steepness is taken
MARGIN, SLOPE = 1.2, 1.3  # of the band's edge: what is kept whole, and where all has gone


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


def clear_band(record: Record, spectrum: Spectrum) -> tuple[Array, Array]:
    """Frequencies in Hz, and what passes of a record's motion as far as it stands out of its noise."""
    f, lines, noise = _lines(record, spectrum)
    clear = np.flatnonzero(_smooth(lines, EDGE_WIDTH_HZ, record) > CLEAR * noise)
    edge = MARGIN * float(f[clear[-1]]) + EDGE_WIDTH_HZ if clear.size else float(f[-1])
    return f, np.clip((SLOPE * edge - f) / ((SLOPE - 1.0) * edge), 0.0, 1.0)


def _shares(record: Record, spectrum: Spectrum) -> list[tuple[Array, Array]]:
    """What may pass of a record's motion, by frequency in Hz: a band with an edge; Wiener's filter."""
    f, lines, noise = _lines(record, spectrum)
    density = np.maximum(_smooth(lines, WIENER_WIDTH_HZ, record), 1e-300)
    return [clear_band(record, spectrum), (f, np.clip(1.0 - noise / density, 0.0, 1.0))]


def _lines(record: Record, spectrum: Spectrum) -> tuple[Array, Array, Array]:
    """Frequencies in Hz, the density of a record's velocity there, and its noise's, in (m/s)²/Hz."""
    lines = periodogram(record.velocity_m_s) * (2.0 / record.rate_hz)
    f = np.asarray(np.fft.rfftfreq(len(record), 1.0 / record.rate_hz), dtype=np.float64)
    return f, lines, spectrum.at(f, record.run)


def _smooth(lines: Array, width_hz: float, record: Record) -> Array:
    size = max(3, round(width_hz * len(record) / record.rate_hz))
    return np.asarray(uniform_filter1d(lines, size, mode="nearest"))


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
    noisy = [replace(r, velocity_m_s=r.velocity_m_s + _drawn(r, spectrum, rng)) for r in records]
    plain = fit.model.on(records).predict(fit.theta)
    moved = fit.model.on(noisy).predict(fit.theta)
    return [(a - b)[:: r.finer] for a, b, r in zip(moved, plain, records, strict=True)]


def steepness(fit: JointFit, records: Sequence[Record]) -> list[Array]:
    """By how much the model's force changes with the velocity, N/(m/s), at each sample of the records."""
    step = SLIGHTLY * max(float(np.max(np.abs(r.velocity_m_s))) for r in records)
    ahead, behind = (
        fit.model.on([replace(r, velocity_m_s=r.velocity_m_s + by) for r in records]).predict(fit.theta)
        for by in (step, -step)
    )
    return [np.abs(a - b) / (2.0 * step) for a, b in zip(ahead, behind, strict=True)]


def _drawn(record: Record, spectrum: Spectrum, rng: np.random.Generator) -> Array:
    """Noise of that spectrum, n samples."""
    n, rate = len(record), record.rate_hz
    f = np.asarray(np.fft.rfftfreq(n, 1.0 / rate), dtype=np.float64)
    level = spectrum.at(f, record.run)
    level[f > 0.5 * rate / record.finer] = 0.0
    if record.passed is not None:
        level *= np.interp(f, *record.passed)  # the noise that passed, and the motion that did not (Wiener)
    size = np.sqrt(0.5 * level * rate * n)
    phase = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
    return np.asarray(np.fft.irfft(size * phase / np.sqrt(2.0), n), dtype=np.float64)
