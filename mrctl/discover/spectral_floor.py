"""The noise of a residual where nothing repeats: read off above the frequencies at which a damper acts.

Sensor noise is white or remembers its last sample. Its spectrum above 30 Hz, where the damper's own force has
faded, fixes a first-order autoregression, whose power is the noise's over the whole band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Array = NDArray[np.float64]

LOWEST_HZ = 30.0
HIGHEST_SHARE = 0.45  # of the sample rate
MOST_COLOUR = 0.9  # beyond this it is no noise that is seen but a model error reaching up
FEWEST_LINES = 50


@dataclass(frozen=True, slots=True)
class SpectralFloor:
    """Noise RMS in N at the residuals' own rate, and how much a sample remembers of the last one (0 to 1)."""

    noise_n: float
    colour: float


def spectral_floor(residuals: Sequence[Array], rates_hz: Sequence[float]) -> SpectralFloor | None:
    """The noise in residuals (n each); None where too little is left above 30 Hz to tell."""
    power, angle = [], []
    for residual, rate in zip(residuals, rates_hz, strict=True):
        n = residual.size
        window = np.hanning(n)
        lines = np.abs(np.fft.rfft((residual - residual.mean()) * window)) ** 2 / np.sum(window**2)
        f = np.fft.rfftfreq(n, 1.0 / rate)
        inside = (f > LOWEST_HZ) & (f < HIGHEST_SHARE * rate)
        power.append(lines[inside])
        angle.append(2.0 * np.pi * f[inside] / rate)
    p, w = np.concatenate(power), np.concatenate(angle)
    if p.size < FEWEST_LINES or float(p.max()) <= 0.0:
        return None

    def unlikely(x: Array) -> float:
        """Whittle's negative log-likelihood."""
        rho = np.tanh(x[1])
        shape = np.exp(x[0]) / (1.0 - 2.0 * rho * np.cos(w) + rho * rho)
        return float(np.sum(np.log(shape) + p / shape))

    best = minimize(unlikely, [np.log(p.mean()), 0.0], method="Nelder-Mead").x
    rho = float(np.tanh(best[1]))
    if abs(rho) > MOST_COLOUR:
        return SpectralFloor(float(np.sqrt(p.mean())), 0.0)
    return SpectralFloor(float(np.sqrt(np.exp(best[0]) / (1.0 - rho * rho))), max(rho, 0.0))
