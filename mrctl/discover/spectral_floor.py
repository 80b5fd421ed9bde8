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
from scipy.optimize import minimize_scalar

Array = NDArray[np.float64]

LOWEST_HZ = 30.0
HIGHEST_SHARE = 0.45  # of the sample rate
COLOURS = np.concatenate([[0.0], 1.0 - np.geomspace(0.9, 0.03, 24)])  # beyond, it may be a model error
AS_LIKELY = 2.0  # log-likelihood: colours that the spectrum cannot rule out
FEWEST_LINES = 50
SMOOTHED = 41  # lines of a drawn noise's spectrum


@dataclass(frozen=True, slots=True)
class SpectralFloor:
    """Noise RMS in N at the residuals' own rate, and how much a sample remembers of the last one (0 to 1).

    `most_n`: the largest RMS that the spectrum does not rule out. Noise that remembers much has little above
    30 Hz to be known by.
    """

    noise_n: float
    colour: float
    most_n: float


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
    brought = float(np.mean(np.concatenate(list(known)) ** 2))
    fits = []
    for colour in COLOURS:
        shape = 1.0 / (1.0 - 2.0 * colour * np.cos(w) + colour * colour)
        unlikely, level = _level(p, shape, k)
        fits.append((unlikely, level / (1.0 - colour * colour) + brought, float(colour)))
    least, noise, colour = min(fits)
    most = max(power for unlikely, power, _ in fits if unlikely < least + AS_LIKELY)
    return SpectralFloor(float(np.sqrt(noise)), colour, float(np.sqrt(most)))


def _level(power: Array, shape: Array, besides: Array) -> tuple[float, float]:
    """Whittle's negative log-likelihood at the best level of a noise of this shape, and that level."""

    def unlikely(log_level: float) -> float:
        density = np.exp(log_level) * shape + besides
        return float(np.sum(np.log(density) + power / density))

    alone = float(np.log(np.mean(power / shape)))  # the best where nothing is besides
    best = minimize_scalar(unlikely, bounds=(alone - 12.0, alone + 1.0), method="bounded")
    return float(best.fun), float(np.exp(best.x))


def periodogram(x: Array) -> Array:
    """A signal's (n) periodogram (n // 2 + 1) under a Hann window: of white noise its variance everywhere."""
    window = np.hanning(x.size)
    return np.asarray(np.abs(np.fft.rfft((x - x.mean()) * window)) ** 2 / np.sum(window**2), dtype=np.float64)
