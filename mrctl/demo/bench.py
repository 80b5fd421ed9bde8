"""A quarter car and the controller's own tick in lock step, talking in CAN frames."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType

from mrctl.can.codec import Encoder, make_decoder, make_encoder
from mrctl.config import Config
from mrctl.control.base import Motion
from mrctl.control.laws import make_law
from mrctl.plant.closed_loop import Controller
from mrctl.runtime.build import Users, frame_specs, input_signals, plan_of
from mrctl.runtime.tick import Frame, Tick


def one_corner(config: Config, current_map: str, *, ideal_coil: bool) -> Config:
    """The configuration's first damper alone, commanded through another current map.

    ideal_coil: no lag to look ahead for, but half a tick, for which the current is held on average.
    """
    name = next(iter(config.dampers))
    update: dict[str, object] = {"current_map": current_map, "map_parameters": {}}
    if ideal_coil:
        update["anticipation_ms"] = 500.0 / config.loop.rate_hz
    return replace(
        config,
        dampers=MappingProxyType({name: config.dampers[name]}),
        control=config.control.model_copy(update=update),
    )


@dataclass(frozen=True, slots=True)
class _Cyclic:
    can_id: int
    encode: Encoder
    users: list[Users]
    every: int


class FrameSource:
    """Encodes the motion of the corners into the frames that the controller reads, at their rates."""

    def __init__(self, config: Config) -> None:
        rate_hz = config.loop.rate_hz
        self._frames = [
            _Cyclic(
                spec.linux_id, make_encoder(spec), users, round(rate_hz / config.frames.receive[spec.name])
            )
            for spec, users in input_signals(config)
        ]

    def frames(self, tick: int, motions: list[Motion]) -> list[Frame]:
        """The frames due at a tick, from the motion of each damper."""
        return [
            (
                one.can_id,
                one.encode([_value(of_signal, motions) for of_signal in one.users], tick // one.every),
            )
            for one in self._frames
            if tick % one.every == 0
        ]


def _value(users: Users, motions: list[Motion]) -> float:
    if not users:
        return math.nan  # nobody asked for this signal
    index, role = users[0]
    motion = motions[index]
    return {
        "relative_velocity": motion.relative_velocity_m_s,
        "body_velocity": motion.body_velocity_m_s,
        "temperature": motion.temperature_c,
        "displacement": motion.displacement_m,
        "force_wish": motion.force_wish_n,
    }[role]


def tick_controller(config: Config) -> Controller:
    """The controller of a one-damper configuration: motion in as frames, the commanded current out of one.

    The wish that it gives along is the law's on the motion as it is, not as the frames tell it.
    """
    law = make_law(config.control.law, config.control.parameters)
    source, tick = FrameSource(config), Tick(plan_of(config))
    spec = frame_specs(config)["CurrentCommand"]
    decode = make_decoder(spec)
    count = 0

    def step(motion: Motion) -> tuple[float, float]:
        nonlocal count
        out = dict(tick.step(source.frames(count, [motion])))
        count += 1
        tick.changes.clear()
        return law(motion), decode(out[spec.linux_id])[0]

    return step
