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

from mrctl.identify.joint import JointFit
from mrctl.identify.records import Record

Array = NDArray[np.float64]

LOWEST_HZ = 30.0  # above what test rigs move at
HIGHEST_SHARE = 0.45  # of the sample rate
BANDS = 6
QUIETEST = 0.25  # quantile over the records: fast motion in some of them is no noise
STEEPEST = 2.0  # a differentiated signal's spectrum rises with the square of the frequency
SEED = 1


def input_noise(fit: JointFit, records: Sequence[Record]) -> list[Array]:
    """A drawing of what the velocity's noise makes of the model's force: N at each sample measured."""
    spectrum = _noise_spectrum(records)
    if spectrum is None:
        return [np.zeros(len(r))[:: r.finer] for r in records]
    rng = np.random.default_rng(SEED)
    noisy = [replace(r, velocity_m_s=r.velocity_m_s + _drawn(r, *spectrum, rng)) for r in records]
    plain = fit.model.on(records).predict(fit.theta)
    moved = fit.model.on(noisy).predict(fit.theta)
    return [(a - b)[:: r.finer] for a, b, r in zip(moved, plain, records, strict=True)]


def _noise_spectrum(records: Sequence[Record]) -> tuple[Array, Array, float] | None:
    """(band middles in Hz, power density in (m/s)²/Hz, rise below them), of the quieter records."""
    top = HIGHEST_SHARE * min(r.rate_hz / r.finer for r in records)
    if top < 1.2 * LOWEST_HZ:
        return None
    edges = np.geomspace(LOWEST_HZ, top, BANDS + 1)
    each = []
    for r in records:
        n = len(r)
        window = np.hanning(n)
        lines = np.abs(np.fft.rfft((r.velocity_m_s - r.velocity_m_s.mean()) * window)) ** 2
        density = 2.0 * lines / (r.rate_hz * np.sum(window**2))
        f = np.fft.rfftfreq(n, 1.0 / r.rate_hz)
        bands = [density[(f >= a) & (f < b)] for a, b in pairwise(edges)]
        if all(b.size for b in bands):
            each.append([float(np.median(b)) / np.log(2.0) for b in bands])  # of an exponential: its mean
    if not each:
        return None
    density = np.quantile(np.array(each), QUIETEST, axis=0)
    if float(density.max()) <= 0.0:
        return None
    middles = np.sqrt(edges[:-1] * edges[1:])
    low = slice(0, BANDS // 2)
    rise = float(np.polyfit(np.log(middles[low]), np.log(np.maximum(density[low], 1e-300)), 1)[0])
    return middles, density, float(np.clip(rise, 0.0, STEEPEST))


def _drawn(record: Record, middles: Array, density: Array, rise: float, rng: np.random.Generator) -> Array:
    """Noise of that density, n samples."""
    n, rate = len(record), record.rate_hz
    f = np.fft.rfftfreq(n, 1.0 / rate)
    level = np.exp(
        np.interp(np.log(np.maximum(f, 1e-6)), np.log(middles), np.log(np.maximum(density, 1e-300)))
    )
    below = f < middles[0]
    level[below] = density[0] * (f[below] / middles[0]) ** rise
    level[0] = 0.0
    level[f > 0.5 * rate / record.finer] = 0.0
    size = np.sqrt(0.5 * level * rate * n)
    phase = rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
    return np.asarray(np.fft.irfft(size * phase / np.sqrt(2.0), n), dtype=np.float64)
