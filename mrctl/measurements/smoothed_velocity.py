"""A velocity column that is the file's own stroke, differentiated and smoothed: told by its noise.

Smoothing takes off a differentiated stroke's noise, and with it the corners of the motion, where a damper is
steep: what it took would seem to be missing from the damper. Two sensors share the motion but not their
noise; a column made from the other shares both, at every frequency. Then the share H(f) that it kept is
known, and with it what it is worth: of a motion of density S in differentiated noise of density N, it misses
|1 - H|² S + |H|² N.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mrctl.measurements.derivative import differentiate, noise_sigma
from mrctl.measurements.run import FloatArray

ComplexArray = npt.NDArray[np.complex128]

SEGMENTS = 12  # at least, of half overlap: chance alone makes a coherence of about 1/8 of it
SHORTEST, LONGEST = 64, 512  # samples in one
ROUNDING = 30.0  # times a column's rounding: less says nothing
SAME = 0.985  # coherence of what shares its noise
NOISY = 1.5  # times the stroke's white noise: less is noise for the most part
SMOOTHED = 0.7  # share of that noise that is kept, at most
FEWEST = 5  # frequencies
# powers of the cosine in the four-term window: 92 dB down beside its main lobe (Harris 1978)
BLACKMAN_HARRIS = (0.21747, -0.45325, 0.28256, -0.04672)
BETTER = 0.9  # of the mean square that the column misses, to be derived anew


def is_smoothed_stroke(velocity_m_s: FloatArray, displacement_m: FloatArray, dt_s: float) -> bool:
    """Whether the velocity (n) is the displacement (n) differentiated and smoothed, better derived anew."""
    v, x = velocity_m_s, displacement_m
    if v.size != x.size or v.size < SHORTEST * SEGMENTS // 2 or not np.ptp(v) or not np.ptp(x):
        return False
    raw = np.gradient(x, dt_s)
    f, kept, alike, power = _shared(v, raw, dt_s)
    noise = 2.0 * dt_s * (noise_sigma(x) * np.sin(2.0 * np.pi * f * dt_s) / dt_s) ** 2
    rounding = 2.0 * dt_s * _step(v) ** 2 / 12.0
    shown = power * np.abs(kept) ** 2 > ROUNDING * rounding
    told = shown & (power < NOISY * noise)
    if np.count_nonzero(told) < FEWEST or float(np.median(alike[told])) < SAME:
        return False
    if float(np.median(np.abs(kept[told]))) > SMOOTHED:
        return False
    _, anew, _, _ = _shared(differentiate(x, dt_s), raw, dt_s)
    motion = np.maximum(power - noise, 0.0)

    def bent(share: ComplexArray) -> float:
        return float(np.sum(np.abs(1.0 - share) ** 2 * motion))

    def noisy(share: ComplexArray) -> float:
        return float(np.sum(np.abs(share) ** 2 * noise))

    less_bent = bent(anew) < bent(kept)
    return less_bent and bent(anew) + noisy(anew) < BETTER * (bent(kept) + noisy(kept))


def _shared(
    y: FloatArray, x: FloatArray, dt_s: float
) -> tuple[FloatArray, ComplexArray, FloatArray, FloatArray]:
    """Frequencies in Hz, the share of x that is in y, their coherence, the density of x (Welch's mean)."""
    size = int(np.clip(2 * x.size // (SEGMENTS + 1), SHORTEST, LONGEST))
    turn = np.cos(2.0 * np.pi * np.arange(size) / size)
    window: FloatArray = np.vander(turn, len(BLACKMAN_HARRIS), increasing=True) @ np.array(BLACKMAN_HARRIS)
    own, other = _spectra(x, window), _spectra(y, window)
    density = np.mean(np.abs(own) ** 2, axis=0)
    shared = np.mean(own.conj() * other, axis=0)
    safe = np.maximum(density, 1e-300)
    alike = np.abs(shared) ** 2 / np.maximum(safe * np.mean(np.abs(other) ** 2, axis=0), 1e-300)
    density *= 2.0 * dt_s / float(window @ window)
    inside = slice(2, -2)  # the ends hold what is left of the mean
    f: FloatArray = np.arange(density.size) / (size * dt_s)
    return f[inside], (shared / safe)[inside], alike[inside], density[inside]


def _spectra(x: FloatArray, window: FloatArray) -> ComplexArray:
    """Of every half overlapping piece of x, less its straight line (pieces × frequencies)."""
    pieces = np.lib.stride_tricks.sliding_window_view(x, window.size)[:: window.size // 2].T
    line = np.vander(np.linspace(-1.0, 1.0, window.size), 2)
    pieces = pieces - line @ np.linalg.lstsq(line, pieces, rcond=None)[0]
    return np.fft.rfft(pieces.T * window, axis=1)


def _step(x: FloatArray) -> float:
    """The step that values are rounded to."""
    steps = np.diff(np.unique(x))
    return float(steps.min()) if steps.size else 0.0
