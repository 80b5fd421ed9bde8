"""What a dyno can be told to do: each protocol is a list of drives, one for each run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from mrctl.plant.dyno import current, motion
from mrctl.plant.dyno.motion import Motion

Array = NDArray[np.float64]
Drives = Iterator["Drive"]

PAPER_CURRENTS_A = (0.0, 1.0, 2.0, 3.0)
PAPER_TEMPERATURES_F = (84, 97, 111, 122, 132, 141, 151, 162, 171, 181)
PAPER_FREQUENCY_HZ = 2.387
INCH_M = 0.0254
SPENCER_FREQUENCY_HZ = 2.5  # Eq. 9.4: 12 pi cos(5 pi t) cm/s
SPENCER_AMPLITUDE_M = 0.024
PAPER_CYCLES = 9
RATE_HZ = 2000.0

AIR_C = 22.0


@dataclass(frozen=True, slots=True)
class Drive:
    """What one run is driven with: motion, driver current (n each), temperature at the start."""

    name: str
    motion: Motion
    current_a: Array
    temperature_c: float
    rate_hz: float
    air_c: float = AIR_C


@dataclass(frozen=True, slots=True)
class Protocol:
    """A named list of drives; `make` takes the sample rate in Hz and the source of its random motions."""

    name: str
    summary: str
    make: Callable[[float, np.random.Generator], Drives]
    rate_hz: float = RATE_HZ


def celsius(fahrenheit: float) -> float:
    """A temperature in degC."""
    return (fahrenheit - 32.0) / 1.8


def _constant(amperes: float, like: Motion) -> Array:
    return np.full(len(like), amperes)


def _paper(rate_hz: float, _: np.random.Generator) -> Drives:
    moving = motion.sine(PAPER_FREQUENCY_HZ, INCH_M, PAPER_CYCLES, rate_hz)
    for i, fahrenheit in product(PAPER_CURRENTS_A, PAPER_TEMPERATURES_F):
        yield Drive(f"{i:.0f}A_{fahrenheit:03d}F", moving, _constant(i, moving), celsius(fahrenheit), rate_hz)


def _grid(rate_hz: float, _: np.random.Generator) -> Drives:
    for frequency, amplitude, i in product(
        (0.5, 1.0, 2.387, 5.0, 10.0), (0.005, 0.0127, 0.0254), (0.0, 0.5, 1.0, 2.0, 3.0)
    ):
        if 2.0 * np.pi * frequency * amplitude > 0.6:
            continue  # more than this dyno's actuator gives
        moving = motion.sine(frequency, amplitude, max(3.0, round(3.0 * frequency)), rate_hz)
        name = f"{frequency:g}Hz_{1e3 * amplitude:g}mm_{i:g}A"
        yield Drive(name, moving, _constant(i, moving), 45.0, rate_hz)


def _currents(rate_hz: float, _: np.random.Generator) -> Drives:
    moving = motion.sine(PAPER_FREQUENCY_HZ, INCH_M, PAPER_CYCLES, rate_hz)
    levels = (0.0, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0)
    for i, temperature in product(levels, (30.0, 55.0, 80.0)):
        yield Drive(f"{i:.2f}A_{temperature:.0f}C", moving, _constant(i, moving), temperature, rate_hz)


def _steps(rate_hz: float, random: np.random.Generator) -> Drives:
    for frequency, temperature in product((1.0, 2.387, 5.0), (30.0, 55.0, 80.0)):
        amplitude = min(INCH_M, 0.4 / (2.0 * np.pi * frequency))
        moving = motion.sine(frequency, amplitude, round(12.0 * frequency), rate_hz)
        amperes = current.steps(random, len(moving), rate_hz)
        yield Drive(f"steps_{frequency:g}Hz_{temperature:.0f}C", moving, amperes, temperature, rate_hz)


def _sweeps(rate_hz: float, _: np.random.Generator) -> Drives:
    for temperature in (30.0, 55.0, 80.0):
        moving = motion.sine(PAPER_FREQUENCY_HZ, INCH_M, 40, rate_hz)
        amperes = current.triangle(len(moving), rate_hz, 8.0)
        yield Drive(f"current_{temperature:.0f}C", moving, amperes, temperature, rate_hz)
        for i in PAPER_CURRENTS_A:
            moving = motion.velocity_sweep(0.5, 15.0, 0.38, 0.03, 15.0, rate_hz)
            name = f"frequency_{i:.0f}A_{temperature:.0f}C"
            yield Drive(name, moving, _constant(i, moving), temperature, rate_hz)


def _road(rate_hz: float, random: np.random.Generator) -> Drives:
    for number, temperature in enumerate((25.0, 33.0, 41.0, 49.0, 57.0, 65.0, 73.0, 81.0)):
        moving = motion.road_like(random, 0.13, 15.0, rate_hz)
        make = current.steps if number % 2 else current.wandering
        amperes = make(random, len(moving), rate_hz)
        yield Drive(f"road_{number + 1}_{temperature:.0f}C", moving, amperes, temperature, rate_hz)


def _heat(rate_hz: float, random: np.random.Generator) -> Drives:
    moving = motion.sine(PAPER_FREQUENCY_HZ, INCH_M, 716, rate_hz)  # five minutes
    amperes = current.steps(random, len(moving), rate_hz, shortest_s=2.0, longest_s=8.0)
    yield Drive("heat_sine", moving, amperes, 24.0, rate_hz)
    moving = motion.road_like(random, 0.2, 300.0, rate_hz)
    amperes = current.wandering(random, len(moving), rate_hz)
    yield Drive("heat_road", moving, amperes, 24.0, rate_hz)


def _spencer(rate_hz: float, _: np.random.Generator) -> Drives:
    for speed, i in product((0.25, 0.5, 0.75, 1.0), (0.0, 0.6, 1.2, 1.8, 2.4, 3.0)):
        moving = motion.sine(SPENCER_FREQUENCY_HZ, speed * SPENCER_AMPLITUDE_M, 8, rate_hz)
        yield Drive(f"{100 * speed:.0f}pc_{i:.1f}A", moving, _constant(i, moving), 25.0, rate_hz)


def _single(rate_hz: float, random: np.random.Generator) -> Drives:
    moving = motion.road_like(random, 0.15, 30.0, rate_hz)
    yield Drive("single", moving, current.steps(random, len(moving), rate_hz), 40.0, rate_hz)


PROTOCOLS = {
    protocol.name: protocol
    for protocol in (
        Protocol("paper", "0, 1, 2, 3 A x 84 to 181 degF, 2.387 Hz, one inch, nine cycles: 40 runs", _paper),
        Protocol("grid", "five frequencies x three amplitudes x five currents at 45 degC", _grid),
        Protocol("currents", "eleven currents, most of them small, at three temperatures", _currents),
        Protocol("steps", "current steps at random during sines of three frequencies", _steps),
        Protocol("sweeps", "current up and down during a sine; frequency from 0.5 to 15 Hz", _sweeps),
        Protocol("road", "road-like motion with changing current from 25 to 81 degC", _road, 1000.0),
        Protocol("heat", "two runs of five minutes in which the damper heats up", _heat, 500.0),
        Protocol("eq-9.4", "2.5 Hz, strokes of 6 to 24 mm, six currents, one temperature", _spencer),
        Protocol("single", "one run of 30 s: road-like motion, current steps", _single),
    )
}
