"""What the vehicle's sensors put on the bus: one value for each role of the configuration."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

from mrctl.plant.corner import CornerState

# The force that another controller would wish for, where the configuration listens to one.
WISHED_DAMPING_N_S_M = 1500.0

# Role in the configuration -> the true value.
TRUTHS: dict[str, Callable[[CornerState], float]] = {
    "relative_velocity": lambda state: state.relative_velocity_m_s,
    "body_velocity": lambda state: state.body_velocity_m_s,
    "body_acceleration": lambda state: state.body_acceleration_m_s2,
    "temperature": lambda state: state.temperature_c,
    "displacement": lambda state: state.displacement_m,
    "force": lambda state: state.force_n,
    "force_wish": lambda state: WISHED_DAMPING_N_S_M * state.relative_velocity_m_s,
}


@dataclass(frozen=True, slots=True)
class Sensor:
    """A measuring chain: offset, white noise (standard deviation), then rounding to a step (0 for none)."""

    noise: float = 0.0
    quantum: float = 0.0
    offset: float = 0.0

    def read(self, truth: float, source: random.Random) -> float:
        """The measured value, in the unit of the truth."""
        value = truth + self.offset + (source.gauss(0.0, self.noise) if self.noise > 0.0 else 0.0)
        return round(value / self.quantum) * self.quantum if self.quantum > 0.0 else value


PERFECT = Sensor()
# Car-grade sensors behind their filters; the frames' own resolution comes on top.
NOISY: dict[str, Sensor] = {
    "relative_velocity": Sensor(noise=0.005),
    "body_velocity": Sensor(noise=0.005),
    "body_acceleration": Sensor(noise=0.05, offset=0.05),
    "temperature": Sensor(noise=0.2, quantum=0.5),
    "displacement": Sensor(noise=0.0003),
    "force": Sensor(noise=5.0),
}
