"""The noise of a residual where nothing repeats: read off above the frequencies at which a damper acts.

Sensor noise is white, or remembers its last sample, or both. Its spectrum above 30 Hz, where the damper's own
force has faded, fixes white noise and a first-order autoregression beside it, whose power is the noise's over
the whole band.
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
COLOURS = np.concatenate([[0.0], 1.0 - np.geomspace(0.9, 0.03, 24)])  # beyond, it may be a model error
AS_LIKELY = 2.0  # log-likelihood: colours that the spectrum cannot rule out
FEWEST_LINES = 50
BANDS = 40  # in which a record's lines are taken together
SMOOTHED = 41  # lines of a drawn noise's spectrum
REACH = 20.0  # of the logarithm of a level, down from where all is that kind of noise


@dataclass(frozen=True, slots=True)
class SpectralFloor:
    """Noise RMS in N at the residuals' own rate.

    `most_n`: the largest RMS that the spectrum does not rule out. Noise that remembers much of the sample
    before has little above 30 Hz to be known by.
    """

    noise_n: float
    most_n: float


@dataclass(frozen=True, slots=True)
class _Bands:
    """Mean power densities of the residuals (n) and of known noise, at angles, with their lines' numbers."""

    angle: Array
    power: Array
    known: Array
    lines: Array


def spectral_floor(
    residuals: Sequence[Array], rates_hz: Sequence[float], known: Sequence[Array]
) -> SpectralFloor | None:
    """The noise in residuals (n each), known part included; None where too little is left above 30 Hz.

    known: drawings of a part of the noise whose spectrum is its own, such as the input's (`input_noise`).
    """
    each = [
        band
        for residual, rate, part in zip(residuals, rates_hz, known, strict=True)
        for band in _bands(residual, rate, part)
    ]
    if not each:
        return None
    bands = _Bands(*(np.concatenate([getattr(b, name) for b in each]) for name in _Bands.__slots__))
    if bands.lines.sum() < FEWEST_LINES or float(bands.power.max()) <= 0.0:
        return None
    brought = float(np.mean(np.concatenate(list(known)) ** 2))
    fits = []
    for colour in COLOURS:
        unlikely, coloured, white = _levels(bands, float(colour))
        power = coloured / (1.0 - colour * colour) + white + brought
        fits.append((unlikely, power))
    least, noise = min(fits)
    most = max(power for unlikely, power in fits if unlikely < least + AS_LIKELY)
    return SpectralFloor(float(np.sqrt(noise)), float(np.sqrt(most)))


def _bands(residual: Array, rate_hz: float, known: Array) -> list[_Bands]:
    """A record's lines, in bands that widen with frequency; none where it has no lines."""
    f = np.fft.rfftfreq(residual.size, 1.0 / rate_hz)
    inside = (f > LOWEST_HZ) & (f < HIGHEST_SHARE * rate_hz)
    if not inside.any():
        return []
    brought = uniform_filter1d(periodogram(known), SMOOTHED, mode="nearest")
    edges = np.geomspace(LOWEST_HZ, HIGHEST_SHARE * rate_hz, BANDS + 1)
    band = np.clip(np.searchsorted(edges, f[inside]) - 1, 0, BANDS - 1)
    lines = np.bincount(band, minlength=BANDS)
    full = lines > 0

    def mean(x: Array) -> Array:
        return np.asarray(np.bincount(band, x[inside], BANDS)[full] / lines[full], dtype=np.float64)

    angle = mean(np.asarray(2.0 * np.pi * f / rate_hz))
    return [_Bands(angle, mean(periodogram(residual)), mean(brought), lines[full].astype(np.float64))]


def _levels(bands: _Bands, colour: float) -> tuple[float, float, float]:
    """Whittle's negative log-likelihood of coloured and white noise at their best levels, and these."""
    shape = 1.0 / (1.0 - 2.0 * colour * np.cos(bands.angle) + colour * colour)

    def unlikely(levels: Array) -> tuple[float, Array]:
        coloured, white = np.exp(levels)
        density = coloured * shape + white + bands.known
        slope = bands.lines * (1.0 / density - bands.power / density**2)
        value = float(bands.lines @ (np.log(density) + bands.power / density))
        return value, np.array([coloured * (slope @ shape), white * slope.sum()])

    # All noise of the one kind, and hardly any of the other or of either a part.
    alone = float(np.log(np.average(bands.power / shape, weights=bands.lines) + 1e-300))
    flat = float(np.log(np.quantile(bands.power, 0.1) + 1e-300))
    bounds = [(alone - REACH, alone + 5.0), (flat - REACH, flat + 5.0)]
    starts = ([alone, flat - 5.0], [alone - 1.0, flat])
    best = min(
        (minimize(unlikely, start, jac=True, method="L-BFGS-B", bounds=bounds) for start in starts),
        key=lambda found: float(found.fun),
    )
    coloured, white = np.exp(best.x)
    return float(best.fun), float(coloured), float(white)


def mean_square(residuals: Sequence[Array]) -> float:
    """Of all samples together."""
    return float(np.mean(np.concatenate(list(residuals)) ** 2))


def periodogram(x: Array) -> Array:
    """A signal's (n) periodogram (n // 2 + 1) under a Hann window: of white noise its variance everywhere."""
    window = np.hanning(x.size)
    return np.asarray(np.abs(np.fft.rfft((x - x.mean()) * window)) ** 2 / np.sum(window**2), dtype=np.float64)
