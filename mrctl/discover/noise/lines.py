"""A line in the spectrum of what a model leaves: a rig that shakes, or the hum of the mains.

Noise of any colour has a smooth spectrum. What stands out of it in a narrow band, in all runs together, has a
cause, which a model of motion, current and temperature does not have. What shakes does so with the motion; a
hum is as strong at any time in any run, and is the measurement's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.noise.spectral_floor import mean_square, periodogram
from mrctl.identify.noise import correlation_inflation

Array = NDArray[np.float64]

LOWEST_HZ = 20.0  # below, missing physics makes harmonics of the motion
HALF_WIDTH_HZ = 3  # a line that swells with the motion is that wide
NEAR_HZ, FAR_HZ = 5, 15  # from the line: what it is held against, on both sides
STANDS_OUT = 2.0  # over the geometric mean of both sides
LEAST_SHARE = 0.15  # of the mean square that is left
MOST_RUNS = 0.5  # share of the runs in which it stands out; what is in few is a motion's harmonic
MOST_HUMS = 6  # a frequency and its multiples
PIECE_S = 1.0  # in which a hum is one sine, ...
ALIKE = 0.25  # ... whose amplitude differs so much between pieces, in standard deviations over the mean
FEWEST_RUNS = 4  # to tell by them what goes with the motion
SWELLS = 0.3  # correlation of a line's power with the square of the speed, ...
CERTAIN = 4.0  # ... in standard errors of none
GRID_HZ = 0.1  # far less than a piece can tell


@dataclass(frozen=True, slots=True)
class Line:
    """Where a line is, and the mean square in N² that it makes."""

    frequency_hz: float
    mean_square_n2: float


def line_of(residuals: Sequence[Array], rates_hz: Sequence[float]) -> Line | None:
    """The strongest line in residuals (n each) in N; None where none stands out in most runs and matters."""
    density = _density(residuals, rates_hz)
    best: Line | None = None
    for hz in range(int(LOWEST_HZ), density.size - FAR_HZ):
        own, around = _beside(density, hz)
        over = float(np.sum(own - around))
        if own.mean() > STANDS_OUT * around and (best is None or over > best.mean_square_n2):
            best = Line(float(hz), over)
    if best is None or best.mean_square_n2 < LEAST_SHARE * mean_square(residuals):
        return None
    each = [_density([r], [rate]) for r, rate in zip(residuals, rates_hz, strict=True)]
    heard = [_beside(one, int(best.frequency_hz)) for one in each]
    seen = [own.mean() > STANDS_OUT * around for own, around in heard if np.isfinite(around)]
    return best if sum(seen) > MOST_RUNS * len(seen) else None


def _beside(density: Array, hz: int) -> tuple[Array, float]:
    """The density about a frequency, and its geometric mean on both sides; NaN where it is not known."""
    below, above = density[hz - FAR_HZ : hz - NEAR_HZ + 1], density[hz + NEAR_HZ : hz + FAR_HZ + 1]
    own = density[hz - HALF_WIDTH_HZ : hz + HALF_WIDTH_HZ + 1]
    known = above.size == FAR_HZ - NEAR_HZ + 1 and np.all(np.isfinite([*below, *own, *above]))
    return own, float(np.sqrt(np.median(below) * np.median(above))) if known else float("nan")


def hums_of(
    residuals: Sequence[Array], rates_hz: Sequence[float], speeds: Sequence[Array]
) -> tuple[list[Line], list[Array]]:
    """Lines as strong at any time in any run, strongest first, and residuals (n each) in N without them.

    speeds: the runs' velocities (n each), which no hum goes with.
    """
    hums: list[Line] = []
    rest = list(residuals)
    line = line_of(rest, rates_hz)
    while line is not None and len(hums) < MOST_HUMS:
        hz = _exactly(rest, rates_hz, line.frequency_hz)
        pieces = [_without(r, rate, hz) for r, rate in zip(rest, rates_hz, strict=True)]
        amplitudes = np.concatenate([own for _, own in pieces])
        less = [r for r, _ in pieces]
        still = line_of(less, rates_hz)
        stays = still is not None and abs(still.frequency_hz - hz) <= 2 * HALF_WIDTH_HZ
        unlike = float(amplitudes.std()) > ALIKE * float(amplitudes.mean())
        if stays or unlike or swells(hz, rest, rates_hz, speeds):
            break
        hums.append(Line(hz, mean_square(rest) - mean_square(less)))
        rest, line = less, still
    return hums, rest


def steady_noise(
    line: Line,
    residuals: Sequence[Array],
    rates_hz: Sequence[float],
    forces: Sequence[Array],
    speeds: Sequence[Array],
) -> bool:
    """Whether a line is as strong in all runs though their forces (n each, N) are not: a colour of noise.

    A frame that is not shaken by the damper rings so: never the same twice, so that it is no hum.
    """
    if len(residuals) < FEWEST_RUNS or swells(line.frequency_hz, residuals, rates_hz, speeds):
        return False
    each = [_density([r], [rate]) for r, rate in zip(residuals, rates_hz, strict=True)]
    heard = [_beside(one, int(line.frequency_hz)) for one in each]
    strong = np.sqrt([max(float(np.sum(own - around)), 0.0) for own, around in heard if np.isfinite(around)])
    active = np.array([float(f.std()) for f in forces])
    alike = strong.size >= FEWEST_RUNS and float(strong.std()) < ALIKE * float(strong.mean())
    return bool(alike and float(active.std()) > ALIKE * float(active.mean()))


def swells(hz: float, residuals: Sequence[Array], rates_hz: Sequence[float], speeds: Sequence[Array]) -> bool:
    """Whether residuals (n each) are the louder about a frequency, the faster (n each) the motion is."""
    alike, samples = [], []
    for residual, rate, speed in zip(residuals, rates_hz, speeds, strict=True):
        f = np.fft.fftfreq(residual.size, 1.0 / rate)
        near = np.abs(f - hz) <= FAR_HZ
        loud = np.abs(np.fft.ifft(np.where(near, np.fft.fft(residual), 0.0))) ** 2
        fast = speed**2
        if np.ptp(loud) > 0.0 and np.ptp(fast) > 0.0:
            alike.append(float(np.corrcoef(loud, fast)[0, 1]))
            samples.append(residual.size / correlation_inflation(loud))
    if not alike:
        return False
    mean = float(np.average(alike, weights=samples))
    return mean > max(SWELLS, CERTAIN / float(np.sqrt(np.sum(samples))))


def _exactly(residuals: Sequence[Array], rates_hz: Sequence[float], near_hz: float) -> float:
    """The frequency near a line's at which there is most."""
    at = np.arange(near_hz - HALF_WIDTH_HZ, near_hz + HALF_WIDTH_HZ, GRID_HZ)
    power = np.zeros(at.size)
    for residual, rate in zip(residuals, rates_hz, strict=True):
        size = max(residual.size, int(rate / GRID_HZ))
        spectrum = np.abs(np.fft.rfft(residual * np.hanning(residual.size), size)) ** 2 / residual.size
        power += np.interp(at, np.fft.rfftfreq(size, 1.0 / rate), spectrum)
    return round(float(at[np.argmax(power)]), 1)


def _without(residual: Array, rate_hz: float, hz: float) -> tuple[Array, Array]:
    """A residual less a sine of that frequency fitted to each piece of it, and the sines' amplitudes in N."""
    rest, amplitudes = [], []
    for part in np.array_split(residual, max(1, round(residual.size / rate_hz / PIECE_S))):
        angle = 2.0 * np.pi * hz / rate_hz * np.arange(part.size)
        waves = np.column_stack([np.cos(angle), np.sin(angle)])
        weights = np.linalg.lstsq(waves, part, rcond=None)[0]
        rest.append(part - waves @ weights)
        amplitudes.append(float(np.hypot(*weights)))
    return np.concatenate(rest), np.array(amplitudes)


def _density(residuals: Sequence[Array], rates_hz: Sequence[float]) -> Array:
    """Power density in N²/Hz in bins of 1 Hz, the mean of all runs; NaN where none has any."""
    size = int(max(rates_hz) / 2.0) + 1
    power, count = np.zeros(size), np.zeros(size)
    for residual, rate in zip(residuals, rates_hz, strict=True):
        at = np.rint(np.fft.rfftfreq(residual.size, 1.0 / rate)).astype(np.intp)
        inside = at < size
        power += np.bincount(at[inside], periodogram(residual)[inside] * 2.0 / rate, size)
        count += np.bincount(at[inside], minlength=size)
    return np.where(count > 0, power / np.maximum(count, 1), np.nan)
