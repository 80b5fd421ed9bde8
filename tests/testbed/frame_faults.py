"""Faults of frames and values on a real bus: what a faulty car sends, as a recording for canplayer.

The kinds are those of tests/runtime/faults.py, but slower, as the guest has one CPU. A fault of a whole frame
hits all dampers. Of the faults of a value each damper has another one at the same time, in turns, until each
damper has had each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from runtime.faults import (
    BODY,
    TEMPERATURE,
    VELOCITY,
    VELOCITY_ID,
    Sent,
    Spoil,
    beside,
    changed,
    config,
    flipped,
    foreign,
    late,
    repeated,
    second_sender,
    swapped,
    without,
)
from vehicle import CONFIG

from mrctl.can.codec import make_encoder
from mrctl.can.specs import ERROR_FLAG, REMOTE_FLAG
from mrctl.runtime.build import input_signals
from mrctl.runtime.tick import Frame

RATE_HZ = 50
TEMPERATURE_EVERY = 5
# Long enough for a machine that others use too, which may stand still for half a second.
TIMEOUT_MS = {VELOCITY: 600.0, BODY: 600.0, TEMPERATURE: 800.0}
LIMP_AFTER_MS = 1200.0
FROZEN_AFTER_MS = 1000.0
FRAMES: dict[str, Any] = {
    "send": {"CurrentCommand": RATE_HZ, "ControllerState": RATE_HZ, "Health": 5},
    "receive": {VELOCITY: RATE_HZ, BODY: RATE_HZ, TEMPERATURE: RATE_HZ // TEMPERATURE_EVERY},
}
_RULES: dict[str, Any] = CONFIG["signals"]
SIGNALS: dict[str, Any] = _RULES | {
    "relative_velocity": _RULES["relative_velocity"]
    | {
        "timeout_ms": TIMEOUT_MS[VELOCITY],
        "limp_after_ms": LIMP_AFTER_MS,
        "frozen_after_ms": FROZEN_AFTER_MS,
        "rate_max": 50.0,  # a jump is one from frame to frame, and these come slower than in a car
    },
    "body_velocity": _RULES["body_velocity"]
    | {"timeout_ms": TIMEOUT_MS[BODY], "frozen_after_ms": FROZEN_AFTER_MS},
    "temperature": _RULES["temperature"] | {"timeout_ms": TIMEOUT_MS[TEMPERATURE]},
}
BEGIN_ID, END_ID = 0x7F0, 0x7F1  # nobody reads them: they part the recording
GOOD_S = 1.0  # of good frames after each fault; twice as long where temperature, which comes slower, is hit
SETTLE_S = 2.0


@dataclass(frozen=True)
class FrameFault:
    """What is wrong with a frame of the car, and what must come of it.

    cause: by which its dampers go into SUBSTITUTE once the signal's time-out is over; "" where they stay
    ACTIVE. then_limp: LIMP follows. wrong: a value, from the tick of the fault (0 is its first) and the right
    one. counted: what the controller says it refused. frozen_ms: until it can be seen that it is frozen.
    """

    frame: str
    what: str
    cause: str = ""
    spoil: Spoil | None = None
    wrong: Callable[[int, float], float] | None = None
    counted: str = ""
    seconds: float = 1.8
    then_limp: bool = False
    frozen_ms: float = 0.0

    @property
    def within_s(self) -> float:
        """From its first frame until the state is the one that it leads to, but for the tick."""
        return (TIMEOUT_MS[self.frame] + self.frozen_ms) / 1000.0

    def __str__(self) -> str:
        return f"{self.frame} {self.what}"


def stuck(name: str) -> Spoil:
    def spoil(car: Any, n: int, sent: Sent) -> Sent:
        return [(own, f) for own, f in sent if own != name] + [p for p in car.sent[-1 - n] if p[0] == name]

    return spoil


def too_short(frame: Frame) -> Frame:
    return frame[0], frame[1][:7]


def remote(frame: Frame) -> Frame:
    return frame[0] | REMOTE_FLAG, b""


_LIMP: Any = {"then_limp": True}
# Two that are counted alike do not follow each other.
OF_FRAMES = (
    FrameFault(VELOCITY, "lost", "RELATIVE_VELOCITY_MISSING", without(VELOCITY), **_LIMP),
    FrameFault(VELOCITY, "late", "RELATIVE_VELOCITY_MISSING", late(VELOCITY, 45)),
    FrameFault(VELOCITY, "repeated", spoil=repeated(VELOCITY), counted="counter", seconds=0.6),
    FrameFault(VELOCITY, "CRC wrong", "RELATIVE_VELOCITY_CRC", changed(VELOCITY, flipped), counted="crc",
               **_LIMP),
    FrameFault(VELOCITY, "counter stuck", "RELATIVE_VELOCITY_COUNTER", stuck(VELOCITY), counted="counter",
               **_LIMP),
    FrameFault(VELOCITY, "beside a flood of error frames", counted="error_frame", seconds=0.6,
               spoil=beside((ERROR_FLAG | 0x4, bytes(8)), times=10)),
    FrameFault(VELOCITY, "out of order", spoil=swapped(VELOCITY), counted="counter", seconds=0.6),
    FrameFault(VELOCITY, "masqueraded", "RELATIVE_VELOCITY_CRC", changed(VELOCITY, foreign), counted="crc",
               **_LIMP),
    FrameFault(VELOCITY, "sent by two", spoil=second_sender(VELOCITY), counted="counter", seconds=0.6),
    FrameFault(VELOCITY, "too short", "RELATIVE_VELOCITY_MALFORMED", changed(VELOCITY, too_short),
               counted="malformed", **_LIMP),
    FrameFault(VELOCITY, "as a remote frame", "RELATIVE_VELOCITY_MISSING", changed(VELOCITY, remote),
               counted="remote_frame", **_LIMP),
    FrameFault(VELOCITY, "beside rubbish with its ID", counted="crc", seconds=0.6,
               spoil=beside((VELOCITY_ID, bytes(8)), times=10)),
    FrameFault(BODY, "lost", "BODY_MOTION_MISSING", without(BODY), seconds=1.2),
    FrameFault(TEMPERATURE, "CRC wrong", "CASE_TEMPERATURE_CRC", changed(TEMPERATURE, flipped), counted="crc",
               seconds=1.4),
)  # fmt: skip
OF_VALUES = (
    (
        FrameFault(VELOCITY, "frozen", "RELATIVE_VELOCITY_FROZEN", wrong=lambda _n, _v: 0.15,
                   counted="frozen", seconds=2.8, frozen_ms=FROZEN_AFTER_MS, **_LIMP),
        FrameFault(VELOCITY, "not available", "RELATIVE_VELOCITY_NOT_AVAILABLE",
                   wrong=lambda _n, _v: math.nan, counted="not_available", seconds=2.8, **_LIMP),
        FrameFault(VELOCITY, "out of range", "RELATIVE_VELOCITY_RANGE", wrong=lambda _n, _v: 2.04,
                   counted="range", seconds=2.8, **_LIMP),
        FrameFault(VELOCITY, "jumps there and back", counted="rate", seconds=2.8,
                   wrong=lambda n, v: -math.copysign(1.95, v) if n == 0 else v),
    ),
    (
        FrameFault(BODY, "frozen", "BODY_MOTION_FROZEN", wrong=lambda _n, _v: 0.1, counted="frozen",
                   seconds=2.2, frozen_ms=FROZEN_AFTER_MS),
        FrameFault(TEMPERATURE, "sensor open", "CASE_TEMPERATURE_NOT_AVAILABLE",
                   wrong=lambda _n, _v: math.nan, counted="not_available", seconds=2.2),
        FrameFault(TEMPERATURE, "sensor shorted", "CASE_TEMPERATURE_RANGE", wrong=lambda _n, _v: 409.5,
                   counted="range", seconds=2.2),
        FrameFault(TEMPERATURE, "jumps", "CASE_TEMPERATURE_RATE", wrong=lambda _n, v: v + 60.0,
                   counted="rate", seconds=2.2),
    ),
)  # fmt: skip
# The parts of the drive: for each damper, its fault.
PARTS = (
    *((fault,) * 4 for fault in OF_FRAMES),
    *(tuple(four[(k + turn) % 4] for k in range(4)) for four in OF_VALUES for turn in range(4)),
)


class Car:
    """Sends what a car sends, as its faults spoil it. What the spoilers of runtime/faults.py know of it."""

    def __init__(self) -> None:
        self.specs = {spec.name: spec for spec, _ in input_signals(config())}
        self.sent: list[Sent] = []  # as it was before it was spoilt
        self._encode = {name: make_encoder(spec) for name, spec in self.specs.items()}
        self._counter = dict.fromkeys(self.specs, 0)

    def frames(self, part: tuple[FrameFault, ...] | None, n: int) -> list[Frame]:
        """The next tick's. n: of the part, from 0."""
        tick = len(self.sent)
        t = tick / RATE_HZ
        values = {
            VELOCITY: [0.3 * math.sin(9.0 * t + k) + 0.1 * math.sin(23.0 * t) for k in range(4)],
            BODY: [0.2 * math.sin(7.0 * t + k) for k in range(4)],
        }
        if tick % TEMPERATURE_EVERY == 0:
            values[TEMPERATURE] = [50.0 + k + t / 20 for k in range(4)]
        for k, fault in enumerate(part or ()):
            if fault.wrong is not None and fault.frame in values:
                values[fault.frame][k] = fault.wrong(n, values[fault.frame][k])
        sent = [(name, self._frame(name, own)) for name, own in values.items()]
        self.sent.append(sent)
        if part and part[0].spoil:
            sent = part[0].spoil(self, n + 1, list(sent))
        return [frame for _, frame in sent]

    def _frame(self, name: str, values: list[float]) -> Frame:
        self._counter[name] += 1
        return self.specs[name].linux_id, self._encode[name](values, self._counter[name])


def recording(numbers: Iterable[int]) -> str:
    """A drive through these of PARTS, as canplayer reads it."""
    car, lines = Car(), []

    def drive(seconds: float, part: tuple[FrameFault, ...] | None = None) -> None:
        for n in range(round(seconds * RATE_HZ)):
            at_us = len(car.sent) * 1_000_000 // RATE_HZ
            lines.extend(line(at_us, *frame) for frame in car.frames(part, n))

    def line(at_us: int, can_id: int, data: bytes) -> str:
        seconds, rest = divmod(at_us, 1_000_000)
        plain = f"{can_id:08X}" if can_id & ERROR_FLAG else f"{can_id & 0x7FF:03X}"
        payload = "R8" if can_id & REMOTE_FLAG else data.hex().upper()
        return f"({1_000_000_000 + seconds}.{rest:06d}) vcan0 {plain}#{payload}"

    drive(SETTLE_S)
    for number in numbers:
        part = PARTS[number]
        for can_id, seconds, of in (
            (BEGIN_ID, max(fault.seconds for fault in part), part),
            (END_ID, GOOD_S * (2 if any(fault.frame == TEMPERATURE for fault in part) else 1), None),
        ):
            lines.append(line(len(car.sent) * 1_000_000 // RATE_HZ, can_id, bytes([number])))
            drive(seconds, of)
    return "\n".join(lines) + "\n"
