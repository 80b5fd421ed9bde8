"""A signal of which a share passes, by frequency, as true at its ends as in its middle.

A filter without phase looks at both sides of a sample. Beyond the ends there is nothing to look at: what is
put there, a mirror image or silence, bends the signal by far more than the noise that is taken out. Here it
is what a signal of that spectrum in that noise would most likely have gone on as (Kolmogorov and Wiener).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.linalg import cho_factor, cho_solve

Array = NDArray[np.float64]

PADDED_S = 1.0
WINDOW = 400  # samples that it is foretold from, ...
FINENESS = 8.0  # ... so many in a period of the fastest that passes
PASSES = 0.01  # share: less is nothing
CLEAREST = 1e5  # density of the signal over the noise's: more is not believed


def smoothed(x: Array, rate_hz: float, passed: tuple[Array, Array]) -> Array:
    """Signals (k, n) of which a share passes; passed: frequencies in Hz from 0 on, and shares (m each)."""
    count, size = x.shape
    pad = min(size - 1, round(PADDED_S * rate_hz))
    beyond = _beyond(np.concatenate([x, x[:, ::-1]]), rate_hz, passed, pad)
    long = np.concatenate([beyond[count:, ::-1], x, beyond[:count]], axis=1)
    trend = np.linspace(long[:, 0], long[:, -1], long.shape[1], axis=1)
    share = np.interp(np.fft.rfftfreq(long.shape[1], 1.0 / rate_hz), *passed)
    smooth = np.fft.irfft(np.fft.rfft(long - trend) * share, long.shape[1]) + trend
    return np.asarray(smooth[:, pad : pad + size], dtype=np.float64)


def _beyond(x: Array, rate_hz: float, passed: tuple[Array, Array], count: int) -> Array:
    """What most likely comes after the last sample of signals (k, n) of the same spectrum: (k, count)."""
    f, share = passed
    passing = np.flatnonzero(share > PASSES)
    fastest = float(f[passing[-1]]) if passing.size else 0.0
    step = max(1, min(int(rate_hz / (FINENESS * max(fastest, 1e-9))), x.shape[1] // 2))
    step -= 1 - step % 2  # odd: then a mean has its place at a sample
    seen = min(WINDOW, x.shape[1] // step)
    last = x[:, x.shape[1] - seen * step :].reshape(-1, seen, step).mean(axis=2)
    middle = last.mean(axis=1, keepdims=True)
    clear = share / np.maximum(1.0 - share, 1.0 / CLEAREST)
    clear[0] = clear[min(1, clear.size - 1)]
    # Covariances in units of the noise's density: the signal's by its lag in samples, the noise's own.
    size = next_fast_len(4 * (seen * step + count), real=True)
    clearness = np.interp(np.fft.rfftfreq(size, 1.0 / rate_hz), f, clear)
    alike = np.fft.irfft(clearness, size)[: size // 2] * 0.5 * rate_hz
    at = np.arange(seen) * step
    known = alike[np.abs(at[:, None] - at[None])]
    known[np.diag_indices(seen)] += 0.5 * rate_hz / step
    weights = cho_solve(cho_factor(known), (last - middle).T)
    ahead = (seen * step + np.arange(count))[:, None] - (at + step // 2)[None]
    return np.asarray(middle + (alike[ahead] @ weights).T, dtype=np.float64)
