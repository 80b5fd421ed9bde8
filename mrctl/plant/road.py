"""Roads: ISO 8608 profiles made from their spectrum, and a bump.

    G_d(n) = G_d(n0) (n / n0)^-2,   n0 = 0.1 1/m

A profile is a sum of cosines with exactly this spectrum and random phases, on an even grid; it repeats
after its length.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

REFERENCE_WAVENUMBER_1_M = 0.1
# G_d(n0) in m^3: geometric means of the classes (ISO 8608, table C.1).
ROUGHNESS_M3 = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6, "E": 4096e-6}
# The standard's range of wavenumbers.
LOWEST_WAVENUMBER_1_M = 0.011
HIGHEST_WAVENUMBER_1_M = 2.83

GRID_M = 0.02
LENGTH_M = 2000.0


class Road(Protocol):
    """The height of the ground along the way."""

    def height_m(self, distance_m: float) -> float:
        """The height in m, upward positive."""


class Flat:
    """No road input."""

    def height_m(self, distance_m: float) -> float:  # noqa: ARG002  # a flat road does not care where
        """0 everywhere."""
        return 0.0


class Bump:
    """A cosine hump, height/2 (1 - cos(2 pi x / length)) from its start on; once, or every so many metres."""

    def __init__(
        self, start_m: float, length_m: float, height_m: float, every_m: float | None = None
    ) -> None:
        """Raises ValueError for a length that is not positive, and for bumps that overlap."""
        if not length_m > 0.0:
            raise ValueError(f"a bump {length_m!r} m long; give a length above 0")
        if every_m is not None and not every_m >= length_m:
            raise ValueError(f"bumps {length_m!r} m long every {every_m!r} m; set them further apart")
        self._every_m = every_m
        self._start_m = start_m
        self._length_m = length_m
        self._height_m = height_m

    def height_m(self, distance_m: float) -> float:
        """The height in m, upward positive."""
        along = distance_m - self._start_m
        if self._every_m is not None and along > 0.0:
            along %= self._every_m
        if along <= 0.0 or along >= self._length_m:
            return 0.0
        return 0.5 * self._height_m * (1.0 - math.cos(2.0 * math.pi * along / self._length_m))


class IsoRoad:
    """A random profile of an ISO 8608 class; the same seed gives the same road."""

    def __init__(
        self, road_class: str, seed: int, length_m: float = LENGTH_M, grid_m: float = GRID_M
    ) -> None:
        """Raises ValueError for a class that is not A to E."""
        try:
            roughness = ROUGHNESS_M3[road_class.upper()]
        except KeyError:
            raise ValueError(f"no road class {road_class!r}; there are {', '.join(ROUGHNESS_M3)}") from None
        self._heights = _synthesise(roughness, np.random.default_rng(seed), length_m, grid_m)
        self._count = len(self._heights)
        self._grid_m = grid_m

    def height_m(self, distance_m: float) -> float:
        """The height in m, upward positive; linear between grid points."""
        at = distance_m / self._grid_m
        whole = math.floor(at)
        low = self._heights[whole % self._count]
        return low + (at - whole) * (self._heights[(whole + 1) % self._count] - low)


class Sum:
    """Several roads on top of each other."""

    def __init__(self, *roads: Road) -> None:
        self._roads = roads

    def height_m(self, distance_m: float) -> float:
        """The height in m, upward positive."""
        total = 0.0
        for road in self._roads:
            total += road.height_m(distance_m)
        return total


def road_psd_m3(wavenumber_1_m: float, road_class: str) -> float:
    """The one-sided displacement spectrum G_d(n) in m^3 of a class (ISO 8608)."""
    return ROUGHNESS_M3[road_class] * (wavenumber_1_m / REFERENCE_WAVENUMBER_1_M) ** -2


def _synthesise(
    roughness_m3: float, random: np.random.Generator, length_m: float, grid_m: float
) -> list[float]:
    """Heights in m on the grid: cosines of amplitude sqrt(2 G_d dn) at every multiple of dn = 1/length."""
    count = round(length_m / grid_m)
    wavenumber = np.arange(count // 2 + 1) / length_m
    inside = (wavenumber >= LOWEST_WAVENUMBER_1_M) & (wavenumber <= HIGHEST_WAVENUMBER_1_M)
    psd = np.zeros_like(wavenumber)
    psd[inside] = roughness_m3 * (wavenumber[inside] / REFERENCE_WAVENUMBER_1_M) ** -2
    amplitude = np.sqrt(2.0 * psd / length_m)
    phase = random.uniform(0.0, 2.0 * np.pi, wavenumber.size)
    heights = np.fft.irfft(0.5 * count * amplitude * np.exp(1j * phase), count)
    return [float(height) for height in heights]
