"""A line in the spectrum of what a model leaves: a rig that shakes or the mains, neither noise nor damper.

Noise of any colour has a smooth spectrum. What stands out of it in a narrow band, in all runs together, has a
cause, which a model of motion, current and temperature does not have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.spectral_floor import periodogram

Array = NDArray[np.float64]

LOWEST_HZ = 20.0  # below, missing physics makes harmonics of the motion
HALF_WIDTH_HZ = 3  # a line that swells with the motion is that wide
NEAR_HZ, FAR_HZ = 5, 15  # from the line: what it is held against, on both sides
STANDS_OUT = 2.0  # over the geometric mean of both sides
LEAST_SHARE = 0.15  # of the mean square that is left


@dataclass(frozen=True, slots=True)
class Line:
    """Where a line is, and the mean square in N² that it makes."""

    frequency_hz: float
    mean_square_n2: float


def line_of(residuals: Sequence[Array], rates_hz: Sequence[float]) -> Line | None:
    """The strongest line in residuals (n each) in N; None where none stands out and matters."""
    power, count = _pooled(residuals, rates_hz)
    seen = count > 0
    density = np.where(seen, power / np.maximum(count, 1), np.nan)
    total = float(np.mean(np.concatenate(list(residuals)) ** 2))
    best: Line | None = None
    for hz in range(int(LOWEST_HZ), density.size - FAR_HZ):
        sides = [density[hz - FAR_HZ : hz - NEAR_HZ + 1], density[hz + NEAR_HZ : hz + FAR_HZ + 1]]
        own = density[hz - HALF_WIDTH_HZ : hz + HALF_WIDTH_HZ + 1]
        if not all(np.all(np.isfinite(part)) for part in (*sides, own)):
            continue
        around = float(np.sqrt(np.median(sides[0]) * np.median(sides[1])))
        over = float(np.sum(own - around))
        if own.mean() > STANDS_OUT * around and (best is None or over > best.mean_square_n2):
            best = Line(float(hz), over)
    return best if best is not None and best.mean_square_n2 > LEAST_SHARE * total else None


def _pooled(residuals: Sequence[Array], rates_hz: Sequence[float]) -> tuple[Array, Array]:
    """Power density in N²/Hz in bins of 1 Hz, summed over spectral lines of all runs, and their number."""
    size = int(max(rates_hz) / 2.0) + 1
    power, count = np.zeros(size), np.zeros(size)
    for residual, rate in zip(residuals, rates_hz, strict=True):
        at = np.rint(np.fft.rfftfreq(residual.size, 1.0 / rate)).astype(np.intp)
        inside = at < size
        power += np.bincount(at[inside], periodogram(residual)[inside] * 2.0 / rate, size)
        count += np.bincount(at[inside], minlength=size)
    return power, count
