"""Four dampers on a virtual CAN bus: car and controller exchange frames and nothing else."""

from __future__ import annotations

import uuid
from collections import Counter
from dataclasses import dataclass

from mrctl.can.codec import make_decoder
from mrctl.can.frames import State
from mrctl.can.ports import open_port
from mrctl.config import Config
from mrctl.control.base import Motion
from mrctl.demo.bench import FrameSource
from mrctl.plant.corner import STEP_S, Corner
from mrctl.plant.quarter_car import QuarterCar
from mrctl.plant.road import IsoRoad
from mrctl.plant.virtual_damper import PhysicsParameters, VirtualDamper
from mrctl.runtime.build import frame_specs, plan_of
from mrctl.runtime.tick import Tick


@dataclass(frozen=True, slots=True)
class BusRun:
    """What went over the bus, and how it ended."""

    seconds: float
    frames_to_controller: int
    frames_from_controller: int
    rejected: int
    states: dict[str, int]  # ticks of all dampers in each state
    rest_a: float  # largest current in the last command


def run_on_bus(config: Config, seconds: float) -> BusRun:
    """Drive for so long, in lock step, shut the controller down, and let it come to rest."""
    channel = f"demo-{uuid.uuid4().hex[:8]}"
    tick = Tick(plan_of(config))
    command = frame_specs(config)["CurrentCommand"]
    decode = make_decoder(command)
    source = FrameSource(config)
    bitrate = config.bus.bitrate
    car = open_port("virtual", channel, bitrate, False, [command.linux_id])
    controller = open_port("virtual", channel, bitrate, False, tick.wanted_ids)
    corners = [_corner(config, k) for k in range(len(config.dampers))]
    currents = [0.0] * len(corners)
    states: Counter[str] = Counter()
    dt_s = 1.0 / config.loop.rate_hz
    count = round(seconds / dt_s)
    patience = count + round(3.0 * config.safety.off_ramp_s / dt_s)
    try:
        n = 0
        while n < patience and not (n > count and tick.at_rest):
            if n == count:
                tick.shut_down()
            for can_id, data in source.frames(n, [_motion(corner) for corner in corners]):
                car.send(can_id, data)
            for can_id, data in tick.step(controller.receive()):
                controller.send(can_id, data)
            for _, data in car.receive():
                currents = list(decode(data))
            for corner, current in zip(corners, currents, strict=True):
                corner.step(dt_s, current)
            states.update(corner.state.name for corner in tick.corners)
            n += 1
        return BusRun(
            n * dt_s,
            controller.counters.received,
            controller.counters.sent,
            tick.rejected.total(),
            {state.name: states[state.name] for state in State},
            max(currents),
        )
    finally:
        car.close()
        controller.close()


def _corner(config: Config, index: int) -> Corner:
    plant = config.plant
    damper = list(config.calibrations.values())[index].damper
    lag = PhysicsParameters(coil_rise_s=plant.coil_lag_s, coil_fall_s=plant.coil_lag_s)
    road = IsoRoad(plant.road_class, plant.seed + index)
    return Corner(
        QuarterCar(road, plant.speed_m_s), VirtualDamper(damper, STEP_S, plant.temperature_c, lag), STEP_S
    )


def _motion(corner: Corner) -> Motion:
    state = corner.state()
    return Motion(
        state.relative_velocity_m_s, state.body_velocity_m_s, state.temperature_c, state.displacement_m
    )
