"""Motions of a dyno: stroke and its exact rate, starting and ending at rest at mid stroke."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Motion:
    """Extension and its rate, sample by sample (n each)."""

    displacement_m: Array
    velocity_m_s: Array

    def __len__(self) -> int:
        return self.displacement_m.size


def clock(seconds: float, rate_hz: float) -> Array:
    """Sample times in s from 0 to `seconds`."""
    return np.arange(round(seconds * rate_hz) + 1) / rate_hz


def eased(time_s: Array, displacement_m: Array, velocity_m_s: Array, ramp_s: float) -> Motion:
    """The motion brought in and out over ramp_s by a raised cosine, its rate that of the product."""
    end = time_s[-1]
    inside = np.clip(np.minimum(time_s, end - time_s) / ramp_s, 0.0, 1.0)
    envelope = 0.5 - 0.5 * np.cos(np.pi * inside)
    slope = 0.5 * np.pi / ramp_s * np.sin(np.pi * inside) * np.sign(0.5 * end - time_s)
    return Motion(displacement_m * envelope, velocity_m_s * envelope + displacement_m * slope)


def sine(frequency_hz: float, amplitude_m: float, cycles: float, rate_hz: float) -> Motion:
    """A sine, brought in and out over half a cycle."""
    t = clock(cycles / frequency_hz, rate_hz)
    omega = 2.0 * math.pi * frequency_hz
    x, v = amplitude_m * np.sin(omega * t), amplitude_m * omega * np.cos(omega * t)
    return eased(t, x, v, 0.5 / frequency_hz)


def velocity_sweep(
    low_hz: float, high_hz: float, speed_m_s: float, amplitude_max_m: float, seconds: float, rate_hz: float
) -> Motion:
    """A sine whose frequency rises in equal ratios; speed and stroke stay below their limits."""
    t = clock(seconds, rate_hz)
    growth = math.log(high_hz / low_hz) / seconds
    frequency = low_hz * np.exp(growth * t)
    phase = 2.0 * math.pi * low_hz / growth * np.expm1(growth * t)
    omega = 2.0 * math.pi * frequency
    # A smooth minimum of the two limits, so that stroke and rate stay smooth.
    limit = speed_m_s / omega
    amplitude = limit * amplitude_max_m / np.sqrt(limit**2 + amplitude_max_m**2)
    amplitude_rate = -growth * amplitude**3 / limit**2
    x = amplitude * np.sin(phase)
    return eased(t, x, amplitude * omega * np.cos(phase) + amplitude_rate * np.sin(phase), 0.5 / low_hz)


@dataclass(frozen=True, slots=True)
class Car:
    """A quarter car whose suspension travel is wanted: usual values of a passenger car's corner."""

    body_kg: float = 400.0
    wheel_kg: float = 45.0
    spring_n_m: float = 22e3
    tyre_n_m: float = 200e3
    damping_n_s_m: float = 1500.0

    def travel_per_height(self, frequency_hz: NDArray[np.floating]) -> NDArray[np.complex128]:
        """Suspension travel per height of the road, at each frequency."""
        s = 2j * np.pi * frequency_hz
        coupling = self.damping_n_s_m * s + self.spring_n_m
        body = self.body_kg * s**2 + coupling
        wheel = self.wheel_kg * s**2 + coupling + self.tyre_n_m
        determinant = body * wheel - coupling**2
        return np.asarray(self.tyre_n_m * (coupling - body) / determinant)


ROAD_BAND_HZ = (0.3, 30.0)


def road_like(
    random: np.random.Generator, speed_rms_m_s: float, seconds: float, rate_hz: float, car: Car | None = None
) -> Motion:
    """Random motion with the spectrum of a suspension on a road whose height falls with frequency squared."""
    t = clock(seconds, rate_hz)
    n = t.size
    f = np.fft.rfftfreq(n, 1.0 / rate_hz)
    inside = (f >= ROAD_BAND_HZ[0]) & (f <= ROAD_BAND_HZ[1])
    spectrum = np.zeros(f.size, dtype=np.complex128)
    gain = np.abs((car or Car()).travel_per_height(f[inside])) / f[inside]
    spectrum[inside] = gain * np.exp(2j * np.pi * random.uniform(size=int(inside.sum())))
    v = np.fft.irfft(2j * np.pi * f * spectrum, n)
    scale = speed_rms_m_s / float(np.sqrt(np.mean(v**2)))
    return eased(t, scale * np.fft.irfft(spectrum, n), scale * v, 1.0)
