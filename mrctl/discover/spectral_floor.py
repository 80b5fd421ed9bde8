"""The noise of a residual where nothing repeats: read off above the frequencies at which a damper acts.

Sensor noise is white or remembers its last sample. Its spectrum above 30 Hz, where the damper's own force has
faded, fixes a first-order autoregression, whose power is the noise's over the whole band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import minimize

Array = NDArray[np.float64]

LOWEST_HZ = 30.0
HIGHEST_SHARE = 0.45  # of the sample rate
MOST_COLOUR = 0.97  # beyond this it may as well be a model error that reaches up
FEWEST_LINES = 50
SMOOTHED = 41  # lines of a drawn noise's spectrum


@dataclass(frozen=True, slots=True)
class SpectralFloor:
    """Noise RMS in N at the residuals' own rate, and how much a sample remembers of the last one (0 to 1)."""

    noise_n: float
    colour: float


def spectral_floor(
    residuals: Sequence[Array], rates_hz: Sequence[float], known: Sequence[Array]
) -> SpectralFloor | None:
    """The noise in residuals (n each), known part included; None where too little is left above 30 Hz.

    known: drawings of a part of the noise whose spectrum is its own, such as the input's (`input_noise`).
    """
    power, besides, angle = [], [], []
    for residual, part, rate in zip(residuals, known, rates_hz, strict=True):
        f = np.fft.rfftfreq(residual.size, 1.0 / rate)
        inside = (f > LOWEST_HZ) & (f < HIGHEST_SHARE * rate)
        power.append(periodogram(residual)[inside])
        besides.append(uniform_filter1d(periodogram(part), SMOOTHED, mode="nearest")[inside])
        angle.append(2.0 * np.pi * f[inside] / rate)
    p, k, w = (np.concatenate(x) for x in (power, besides, angle))
    if p.size < FEWEST_LINES or float(p.max()) <= 0.0:
        return None

    def unlikely(x: Array) -> float:
        """Whittle's negative log-likelihood."""
        rho = np.tanh(x[1])
        shape = np.exp(x[0]) / (1.0 - 2.0 * rho * np.cos(w) + rho * rho) + k
        return float(np.sum(np.log(shape) + p / shape))

    best = minimize(unlikely, [np.log(p.mean()), 0.0], method="Nelder-Mead").x
    rho = float(np.tanh(best[1]))
    brought = float(np.mean(np.concatenate(list(known)) ** 2))
    if abs(rho) > MOST_COLOUR:
        return SpectralFloor(float(np.sqrt(max(p.mean() - k.mean(), 0.0) + brought)), 0.0)
    own = float(np.exp(best[0]) / (1.0 - rho * rho))
    return SpectralFloor(float(np.sqrt(own + brought)), max(rho, 0.0))


def periodogram(x: Array) -> Array:
    """A signal's (n) periodogram (n // 2 + 1) under a Hann window: of white noise its variance everywhere."""
    window = np.hanning(x.size)
    return np.asarray(np.abs(np.fft.rfft((x - x.mean()) * window)) ** 2 / np.sum(window**2), dtype=np.float64)
