"""What two channels share, frequency by frequency."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mrctl.measurements.run import FloatArray

ComplexArray = npt.NDArray[np.complex128]

SEGMENTS = 12  # at least, of half overlap: chance alone makes a coherence of about 1/8 of it
SHORTEST, LONGEST = 64, 512  # samples in one
# powers of the cosine in the four-term window: 92 dB down beside its main lobe (Harris 1978)
BLACKMAN_HARRIS = (0.21747, -0.45325, 0.28256, -0.04672)


def shared(
    y: FloatArray, x: FloatArray, dt_s: float
) -> tuple[FloatArray, ComplexArray, FloatArray, FloatArray]:
    """What of x (n) is in y (n), at frequencies in Hz: its share there, their coherence, the density of x.

    Welch's mean (IEEE Trans. Audio Electroacoust. 15 (1967)); the density is in units of x squared per Hz.
    Raises ValueError for fewer samples than one segment.
    """
    if x.size < SHORTEST:
        raise ValueError(f"{x.size} samples are fewer than a segment's {SHORTEST}")
    size = int(np.clip(2 * x.size // (SEGMENTS + 1), SHORTEST, LONGEST))
    turn = np.cos(2.0 * np.pi * np.arange(size) / size)
    window: FloatArray = np.vander(turn, len(BLACKMAN_HARRIS), increasing=True) @ np.array(BLACKMAN_HARRIS)
    own, other = _spectra(x, window), _spectra(y, window)
    density = np.mean(np.abs(own) ** 2, axis=0)
    both = np.mean(own.conj() * other, axis=0)
    safe = np.maximum(density, 1e-300)
    alike = np.abs(both) ** 2 / np.maximum(safe * np.mean(np.abs(other) ** 2, axis=0), 1e-300)
    density *= 2.0 * dt_s / float(window @ window)
    inside = slice(2, -2)  # the ends hold what is left of the mean
    f: FloatArray = np.arange(density.size) / (size * dt_s)
    return f[inside], (both / safe)[inside], alike[inside], density[inside]


def _spectra(x: FloatArray, window: FloatArray) -> ComplexArray:
    """Of every half overlapping piece of x, less its straight line (pieces × frequencies)."""
    pieces = np.lib.stride_tricks.sliding_window_view(x, window.size)[:: window.size // 2].T
    line = np.vander(np.linspace(-1.0, 1.0, window.size), 2)
    pieces = pieces - line @ np.linalg.lstsq(line, pieces, rcond=None)[0]
    return np.fft.rfft(pieces.T * window, axis=1)


def can_be_shared(y: FloatArray, x: FloatArray) -> bool:
    """Whether both channels vary, and long enough for `shared` to tell chance from what they share."""
    return y.size == x.size and x.size >= SHORTEST * SEGMENTS // 2 and bool(np.ptp(x)) and bool(np.ptp(y))


def rounding_density(x: FloatArray, dt_s: float) -> float:
    """The power density, in units of values (n) squared per Hz, of their rounding; 0 where all are alike."""
    steps = np.diff(np.unique(x))
    step = float(steps.min()) if steps.size else 0.0
    return 2.0 * dt_s * step**2 / 12.0
