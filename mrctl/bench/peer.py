"""The peers of the tick benchmark: the same job with python-can, cantools and numpy, in two ways.

Both decode messages by signal name with cantools, look tables up with `numpy.interp`, filter with arrays and
encode the command with cantools. `PerDamper` goes through the dampers one by one, as one writes it first;
`Vectorised` treats the four dampers as vectors. They keep to the model (Eq. 8.1, both states of h tried) and
to the E2E protection, but refine nothing and have no plausibility checks, states or output guard.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrctl.can import e2e
from mrctl.can.database import load_database
from mrctl.can.quiet_import import can, cantools
from mrctl.config import Config

Vector = NDArray[np.float64]

SKY_N_S_M = 3000.0


class Peer(ABC):
    """Frames as `can.Message` in, one `can.Message` out; continuous skyhook and the inverse model."""

    def __init__(self, config: Config) -> None:
        self._database: Any = cantools.database.load_file(config.database)
        self._data_ids = {spec.can_id: spec.data_ids for spec in load_database(config.database).values()}
        self._dampers = list(config.dampers.values())
        damper = next(iter(config.calibrations.values())).damper
        tables, inverse = damper.static, damper.inverse_filter.resampled(config.loop.rate_hz)
        self._currents, self._forces = np.array(tables.current_a), np.array(tables.force_n)
        self._velocities, self._shape = np.array(tables.velocity_m_s), np.array(tables.shape)
        self._temperatures = np.array(tables.temperature_c)
        self._h_off, self._h_on = np.array(tables.h_off), np.array(tables.h_on)
        self._on_above = tables.on_above_a
        self._b, self._a = np.array(inverse.b), np.array(inverse.a)
        self._current_max = damper.current_max_a
        self._step_max = damper.current_slew_a_s / config.loop.rate_hz
        self._values: dict[str, float] = {}
        self._counter = 0

    def step(self, messages: list[Any]) -> Any:  # noqa: ANN401  # python-can's Message
        """One tick."""
        for message in messages:
            if e2e.check(bytes(message.data), self._data_ids[message.arbitration_id]):
                self._values.update(self._database.decode_message(message.arbitration_id, message.data))
        return self._encode(self._control())

    @abstractmethod
    def _control(self) -> Vector:
        """The currents in A, one for each damper."""

    def _value(self, damper: int, role: str) -> float:
        return float(self._values.get(self._dampers[damper].signals[role], 0.0))

    def _encode(self, currents: Vector) -> Any:  # noqa: ANN401  # python-can's Message
        message = self._database.get_message_by_name("CurrentCommand")
        signals = {signal.name: 0.0 for signal in message.signals}
        signals |= {d.command: float(i) for d, i in zip(self._dampers, currents, strict=True)}
        data = bytearray(message.encode(signals))
        e2e.protect(data, self._data_ids[message.frame_id], self._counter)
        self._counter += 1
        return can.Message(arbitration_id=message.frame_id, data=data, is_extended_id=False)


class PerDamper(Peer):
    """One damper after the other."""

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self._inputs = np.zeros((len(self._dampers), 4))
        self._outputs = np.zeros((len(self._dampers), 3))
        self._current = np.zeros(len(self._dampers))

    def _control(self) -> Vector:
        for k in range(len(self._dampers)):
            velocity, body = self._value(k, "relative_velocity"), self._value(k, "body_velocity")
            temperature = self._value(k, "temperature")
            wish = SKY_N_S_M * body if velocity * body > 0.0 else 0.0
            self._inputs[k] = np.roll(self._inputs[k], 1)
            self._inputs[k, 0] = wish
            back = np.dot(self._b, self._inputs[k]) - np.dot(self._a[1:], self._outputs[k])
            self._outputs[k] = np.roll(self._outputs[k], 1)
            self._outputs[k, 0] = back
            g = np.interp(velocity, self._velocities, self._shape)
            h_off = np.interp(temperature, self._temperatures, self._h_off)
            h_on = np.interp(temperature, self._temperatures, self._h_on)
            q = back / g if back * g > 0.0 else 0.0
            on = np.interp(q / h_on, self._forces, self._currents)
            off = np.interp(q / h_off, self._forces, self._currents)
            wanted = np.clip(on if on >= self._on_above else min(off, self._on_above), 0.0, self._current_max)
            self._current[k] += np.clip(wanted - self._current[k], -self._step_max, self._step_max)
        return self._current


class Vectorised(Peer):
    """All dampers at once."""

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self._state = np.zeros((4, len(self._dampers)))
        self._current = np.zeros(len(self._dampers))

    def _control(self) -> Vector:
        velocity, body = self._vector("relative_velocity"), self._vector("body_velocity")
        temperature = self._vector("temperature")
        wish = np.where(velocity * body > 0.0, SKY_N_S_M * body, 0.0)
        back = self._b[0] * wish + self._state[0]
        self._state[:3] = self._b[1:, None] * wish - self._a[1:, None] * back + self._state[1:]
        g = np.interp(velocity, self._velocities, self._shape)
        h_off = np.interp(temperature, self._temperatures, self._h_off)
        h_on = np.interp(temperature, self._temperatures, self._h_on)
        with np.errstate(divide="ignore", invalid="ignore"):
            q = np.where(back * g > 0.0, back / g, 0.0)
        on = np.interp(q / h_on, self._forces, self._currents)
        off = np.interp(q / h_off, self._forces, self._currents)
        wanted = np.where(on >= self._on_above, on, np.minimum(off, self._on_above))
        wanted = np.clip(wanted, 0.0, self._current_max)
        self._current = self._current + np.clip(wanted - self._current, -self._step_max, self._step_max)
        return self._current

    def _vector(self, role: str) -> Vector:
        return np.array([self._value(k, role) for k in range(len(self._dampers))])
