"""Currents that change during a run (n samples each), between 0 and the driver's largest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LARGEST_A = 3.0


def steps(
    random: np.random.Generator, n: int, rate_hz: float, shortest_s: float = 0.15, longest_s: float = 0.8
) -> Array:
    """Levels at random, each held for a time at random; every fifth or so is 0 A."""
    amperes = np.empty(n)
    at = 0
    while at < n:
        level = 0.0 if random.uniform() < 0.2 else LARGEST_A * random.uniform()
        length = max(1, round(rate_hz * random.uniform(shortest_s, longest_s)))
        amperes[at : at + length] = np.round(level, 3)
        at += length
    return amperes


def triangle(n: int, rate_hz: float, period_s: float) -> Array:
    """Up and down in straight lines, from 0."""
    phase = np.arange(n) / rate_hz / period_s % 1.0
    return LARGEST_A * (1.0 - np.abs(2.0 * phase - 1.0))


def wandering(random: np.random.Generator, n: int, rate_hz: float, fastest_hz: float = 4.0) -> Array:
    """A smooth random current that stays at 0 for a while where it would be negative."""
    f = np.fft.rfftfreq(n, 1.0 / rate_hz)
    spectrum = np.where((f > 0.0) & (f < fastest_hz), 1.0, 0.0) * np.exp(
        2j * np.pi * random.uniform(size=f.size)
    )
    x = np.fft.irfft(spectrum, n)
    return np.asarray(np.clip(1.2 + 1.1 * x / x.std(), 0.0, LARGEST_A), dtype=np.float64)
