"""What the bench's sensors make of the truth: noise and rounding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Sensor:
    """White noise of an RMS in the unit of the channel, and the decimals that are recorded (None: all)."""

    noise: float
    decimals: int | None

    def read(self, truth: Array, random: np.random.Generator) -> Array:
        """The readings (n). The source of noise is used as much by a perfect sensor as by any other."""
        values = truth + self.noise * random.standard_normal(truth.size)
        return values if self.decimals is None else np.round(values, self.decimals)


@dataclass(frozen=True, slots=True)
class Sensors:
    """The bench's three measured channels."""

    force_n: Sensor
    velocity_m_s: Sensor
    temperature_c: Sensor


FORCE_NOISE_N = 3.0


def bench_sensors(force_noise_n: float = FORCE_NOISE_N) -> Sensors:
    """Load cell, tachometer and infrared pyrometer; the noise of the other two goes with the load cell's.

    At 3 N: 0.3 mm/s and 0.05 K. Without noise nothing is rounded either: the readings are the truth.
    """
    if force_noise_n == 0.0:
        exact = Sensor(0.0, None)
        return Sensors(exact, exact, exact)
    share = force_noise_n / FORCE_NOISE_N
    return Sensors(Sensor(force_noise_n, 2), Sensor(3e-4 * share, 6), Sensor(0.05 * share, 2))
