"""The simulated vehicle on the bus: a function of the frames that came in and of the time that went by."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from mrctl.can.codec import make_encoder
from mrctl.can.specs import FrameSpec
from mrctl.config import Config, PlantConfig
from mrctl.model.damper import Damper
from mrctl.plant.coil_driver import CoilDriver
from mrctl.plant.corner import STEP_S, Corner, CornerState
from mrctl.plant.quarter_car import QuarterCar
from mrctl.plant.road import Bump, IsoRoad, Road, Sum
from mrctl.plant.sensing import NOISY, PERFECT, TRUTHS
from mrctl.plant.virtual_damper import PhysicsParameters, VirtualDamper
from mrctl.runtime.build import frame_specs, input_signals
from mrctl.runtime.tick import Frame, LoopFigures

BUMP_LENGTH_M = 4.0
BUMP_START_M = 100.0
BUMP_EVERY_M = 200.0
WHEELBASE_M = 2.7
# After a pause longer than this (a suspended process) the vehicle does not drive the whole way it missed.
CATCH_UP_S = 0.25


@dataclass(slots=True)
class Tally:
    """Sums over a corner's run, for the summary."""

    samples: int = 0
    acceleration: float = 0.0
    tyre: float = 0.0
    force: float = 0.0
    current: float = 0.0

    def add(self, state: CornerState, static_tyre_n: float) -> None:
        """One sample more."""
        self.samples += 1
        self.acceleration += state.body_acceleration_m_s2**2
        self.tyre += (state.tyre_force_n - static_tyre_n) ** 2
        self.force += state.force_n**2
        self.current += state.current_a

    def rms(self, total: float) -> float:
        """Root of the mean of a sum of squares."""
        return math.sqrt(total / self.samples) if self.samples else 0.0


@dataclass(slots=True)
class Publisher:
    """One sensor frame: when it is due, and what it says. Users: (damper, role) of each signal."""

    spec: FrameSpec
    period_s: float
    users: Sequence[Sequence[tuple[int, str]]]
    due_s: float = 0.0
    counter: int = 0
    encode: Any = field(init=False)

    def __post_init__(self) -> None:
        """Build the encoder."""
        self.encode = make_encoder(self.spec)

    def is_due(self, now_s: float) -> bool:
        """Whether to send now; what a late process missed is left out, not sent in a burst."""
        if now_s < self.due_s - 1e-9:
            return False
        late = math.floor((now_s - self.due_s) / self.period_s + 1e-9)
        self.due_s += (late + 1) * self.period_s
        return True


class Vehicle:
    """Corners on a road, their sensors and power stages, behind a `step` as the loop wants it."""

    def __init__(self, config: Config, plant: PlantConfig, *, noisy: bool = False) -> None:
        """The configuration's dampers on the road of `plant`, all dampers equally warm, at rest.

        Dampers in the configuration's order: left and right of the first axle, then of the second, which
        follows in the same tracks. Raises InputError when the DBC lacks what the configuration names.
        """
        receive = config.frames.receive
        command = frame_specs(config)["CurrentCommand"]
        dampers = [config.calibrations[name].damper for name in config.dampers]
        self._command_id = command.linux_id
        self._driver = CoilDriver(command, [damper.current_max_a for damper in dampers])
        self._publishers = [
            Publisher(spec, 1.0 / receive[spec.name], users) for spec, users in input_signals(config)
        ]
        rates = [*receive.values(), config.frames.send["CurrentCommand"]]
        self._steps = max(1, math.floor(1.0 / (max(rates) * STEP_S) + 1e-9))
        self._names = tuple(config.dampers)
        self._corners = _corners(dampers, plant)
        self._tallies = [Tally() for _ in self._corners]
        self._sensors = {role: NOISY.get(role, PERFECT) if noisy else PERFECT for role in TRUTHS}
        self._random = random.Random(plant.seed)
        self._catch_up = max(1, round(CATCH_UP_S / self.period_s))
        self._periods = 0
        self.lost_periods = 0

    @property
    def period_s(self) -> float:
        """Time between two calls of `step`."""
        return self._steps * STEP_S

    @property
    def wanted_ids(self) -> frozenset[int]:
        """The frames that the vehicle listens to."""
        return frozenset((self._command_id,))

    def step(self, frames: Sequence[Frame], periods: int, _figures: LoopFigures) -> list[Frame]:
        """Drive on by so many periods with the commands that came in; the frames to send."""
        now_s = self._periods * self.period_s
        for can_id, data in frames:
            if can_id == self._command_id:
                self._driver.take(data, now_s)
        self._periods += periods
        self.lost_periods += max(0, periods - self._catch_up)
        for _ in range(min(periods, self._catch_up)):
            self._drive(now_s)
            now_s += self.period_s
        return self._measure(self._periods * self.period_s)

    def summary(self) -> dict[str, Any]:
        """What happened so far, for `--json`."""
        return {
            "seconds": self._periods * self.period_s,
            "lost_seconds": self.lost_periods * self.period_s,
            "commands": self._driver.good,
            "rejected": dict(self._driver.rejected),
            "timeouts": self._driver.timeouts,
            "dampers": {
                name: {
                    "temperature_c": corner.damper.temperature_c,
                    "current_mean_a": tally.current / max(1, tally.samples),
                    "force_rms_n": tally.rms(tally.force),
                    "body_acceleration_rms_m_s2": tally.rms(tally.acceleration),
                    "tyre_load_variation_rms_n": tally.rms(tally.tyre),
                }
                for name, corner, tally in zip(self._names, self._corners, self._tallies, strict=True)
            },
        }

    def _drive(self, now_s: float) -> None:
        currents = self._driver.currents_a(now_s)
        for corner, tally, current_a in zip(self._corners, self._tallies, currents, strict=True):
            corner.step(self.period_s, current_a)
            tally.add(corner.state(), corner.car.static_tyre_force_n)

    def _measure(self, now_s: float) -> list[Frame]:
        due = [publisher for publisher in self._publishers if publisher.is_due(now_s)]
        if not due:
            return []
        states = [corner.state() for corner in self._corners]
        out: list[Frame] = []
        for publisher in due:
            values = [self._read(states, users) for users in publisher.users]
            out.append((publisher.spec.linux_id, publisher.encode(values, publisher.counter)))
            publisher.counter = (publisher.counter + 1) & 0xF
        return out

    def _read(self, states: Sequence[CornerState], users: Sequence[tuple[int, str]]) -> float:
        """The value of a signal; one that nobody uses is not available."""
        if not users:
            return math.nan
        corner, role = users[0]
        return self._sensors[role].read(TRUTHS[role](states[corner]), self._random)


def _corners(dampers: Sequence[Damper], plant: PlantConfig) -> list[Corner]:
    tracks: list[Road] = [
        Sum(
            IsoRoad(plant.road_class, 2 * plant.seed + side),
            Bump(BUMP_START_M, BUMP_LENGTH_M, plant.bump_height_m, BUMP_EVERY_M),
        )
        for side in range(2)
    ]
    physics = PhysicsParameters(coil_rise_s=plant.coil_lag_s, coil_fall_s=plant.coil_lag_s)
    return [
        Corner(
            QuarterCar(tracks[index % 2], plant.speed_m_s, start_m=-WHEELBASE_M * (index // 2)),
            VirtualDamper(damper, STEP_S, plant.temperature_c, physics),
        )
        for index, damper in enumerate(dampers)
    ]
