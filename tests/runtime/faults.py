"""The fault matrix on a clock of its own: faults of frames and values, and what must come of each.

    PYTHONPATH=tests python tests/runtime/faults.py     prints the table

The controller of config/vehicle.yaml, its four dampers driven by good frames. A fault begins at FAULT_AT and
lasts; its dampers must reach their state within the signal's time-out plus one tick, all others stay ACTIVE,
every command keeps range and slew, the cause is named, and once the fault is over all are ACTIVE again.
Faults of the operating system (link, process, clock, disk) are in tests/testbed/test_system_faults.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise

from mrctl.can.codec import make_decoder, make_encoder
from mrctl.can.frames import State
from mrctl.can.specs import FD_FLAG
from mrctl.config import Config, load_config
from mrctl.runtime.build import frame_specs, input_signals, plan_of
from mrctl.runtime.tick import Frame, Tick
from mrctl.share_path import share_file

RATE_HZ = 500
TEMPERATURE_EVERY = 50  # ticks
FAULT_AT = 600  # the tick before the first that is spoilt
VELOCITY, BODY, TEMPERATURE = "RelativeVelocity", "BodyVelocity", "CaseTemperature"
RECOVERY_TICKS = 650
ROLE = {VELOCITY: "relative_velocity", BODY: "body_velocity", TEMPERATURE: "temperature"}
ALL = range(4)

Sent = list[tuple[str, Frame]]  # the frames of one tick, by name
Spoil = Callable[["Bench", int, Sent], Sent]
SpoilValues = Callable[["Bench", int, str, list[float]], list[float]]


@cache
def config() -> Config:
    return load_config(share_file("config/vehicle.yaml"))


@dataclass(frozen=True)
class Fault:
    """spoil: what becomes of the frames of tick n (from 1, counted from the fault's first); or of the values.

    state, cause: what its dampers go into, first; None where they stay ACTIVE and `counted` is the trace.
    within_ms: after so long, plus one tick. then: a further state, after then_ms. `only` the damper under
    test is hit, or all.
    """

    name: str
    state: State | None = None
    cause: str = ""
    within_ms: float = 0.0
    spoil: Spoil | None = None
    values: SpoilValues | None = None
    then: State | None = None
    then_ms: float = 0.0
    counted: str = ""
    seconds: float = 0.5
    only: bool = False


@dataclass
class Bench:
    """Sends what the car sends, as the fault spoils it, and keeps what comes of it."""

    fault: Fault
    corner: int
    tick: Tick = field(default_factory=lambda: Tick(plan_of(config())))
    sent: list[Sent] = field(default_factory=list)  # as the car sent it
    commands: list[tuple[float, ...]] = field(default_factory=list)
    states: list[tuple[State, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.specs = {spec.name: spec for spec, _ in input_signals(config())}
        self._encode = {name: make_encoder(spec) for name, spec in self.specs.items()}
        self._counter = dict.fromkeys(self.specs, 0)
        spec = frame_specs(config())["CurrentCommand"]
        self._command_id, self._decode = spec.linux_id, make_decoder(spec)

    def encode(self, name: str, values: list[float]) -> Frame:
        self._counter[name] += 1
        return self.specs[name].linux_id, self._encode[name](values, self._counter[name])

    def run(self) -> Bench:
        over = FAULT_AT + round(self.fault.seconds * RATE_HZ)
        for n in range(1, over + RECOVERY_TICKS):
            spoilt = n - FAULT_AT if FAULT_AT < n <= over else 0
            frames = self._frames(n, spoilt)
            self.sent.append(frames)
            if spoilt and self.fault.spoil:
                frames = self.fault.spoil(self, spoilt, list(frames))
            for can_id, data in self.tick.step([frame for _, frame in frames]):
                if can_id == self._command_id:
                    self.commands.append(self._decode(data))
            self.states.append(tuple(corner.state for corner in self.tick.corners))
        return self

    def _frames(self, n: int, spoilt: int) -> Sent:
        t = n / RATE_HZ
        values = {
            VELOCITY: [0.3 * math.sin(9.0 * t + k) + 0.1 * math.sin(63.0 * t) for k in ALL],
            BODY: [0.2 * math.sin(7.0 * t + k) for k in ALL],
        }
        if n % TEMPERATURE_EVERY == 0:
            values[TEMPERATURE] = [50.0 + k + t / 10 for k in ALL]
        if spoilt and self.fault.values:
            values = {name: self.fault.values(self, spoilt, name, own) for name, own in values.items()}
        return [(name, self.encode(name, own)) for name, own in values.items()]

    def hit(self) -> Iterable[int]:
        """The dampers that the fault hits."""
        return (self.corner,) if self.fault.only else ALL

    def reached_after(self, state: State) -> float:
        """ms from the fault's first tick until all that it hits are in that state; inf if never."""
        for n, states in enumerate(self.states[FAULT_AT:], start=1):
            if all(states[k] is state for k in self.hit()):
                return 1000.0 * n / RATE_HZ
        return math.inf

    def recovered_after(self) -> float:
        """ms from the end of the fault until all are ACTIVE for good."""
        over = FAULT_AT + round(self.fault.seconds * RATE_HZ)
        bad = [n for n, states in enumerate(self.states, 1) if n > over and set(states) != {State.ACTIVE}]
        return 1000.0 * (bad[-1] - over) / RATE_HZ if bad else 0.0

    def causes(self) -> set[str]:
        """The causes that the log names for the dampers hit, during the fault."""
        names = [list(config().dampers)[k] for k in self.hit()]
        over = FAULT_AT + round(self.fault.seconds * RATE_HZ)
        return {c.cause for c in self.tick.changes if FAULT_AT < c.tick <= over and c.damper in names}

    def largest_step_a(self) -> float:
        """The largest change of a command from tick to tick."""
        return max(abs(b - a) for x, y in pairwise(self.commands) for a, b in zip(x, y, strict=True))


def without(*names: str) -> Spoil:
    return lambda _bench, _n, sent: [(name, frame) for name, frame in sent if name not in names]


def changed(name: str, change: Callable[[Frame], Frame]) -> Spoil:
    return lambda _b, _n, sent: [(own, change(frame) if own == name else frame) for own, frame in sent]


def late(name: str, ticks: int) -> Spoil:
    def spoil(bench: Bench, n: int, sent: Sent) -> Sent:
        before = bench.sent[-1 - ticks] if n > ticks else []
        return [(own, f) for own, f in sent if own != name] + [(own, f) for own, f in before if own == name]

    return spoil


def bunched(name: str, ticks: int) -> Spoil:
    def spoil(bench: Bench, n: int, sent: Sent) -> Sent:
        kept = [(own, f) for own, f in sent if own != name]
        if n % ticks == 0:
            kept += [(own, f) for tick in bench.sent[-ticks:] for own, f in tick if own == name]
        return kept

    return spoil


def swapped(name: str) -> Spoil:
    def spoil(bench: Bench, n: int, sent: Sent) -> Sent:
        kept = [(own, f) for own, f in sent if own != name]
        if n % 2 == 0:
            kept += [(own, f) for tick in reversed(bench.sent[-2:]) for own, f in tick if own == name]
        return kept

    return spoil


def repeated(name: str) -> Spoil:
    return lambda _b, _n, sent: [pair for own, f in sent for pair in [(own, f)] * (3 if own == name else 1)]


def stuck(name: str) -> Spoil:
    def spoil(bench: Bench, _n: int, sent: Sent) -> Sent:
        first = [(own, f) for own, f in bench.sent[FAULT_AT - 1] if own == name]
        return [(own, f) for own, f in sent if own != name] + first

    return spoil


def beside(*frames: Frame, times: int = 1) -> Spoil:
    return lambda _b, _n, sent: [*[("", frame) for frame in frames] * times, *sent]


def second_sender(name: str) -> Spoil:
    """Another control unit sends the same frame with a counter of its own."""

    def spoil(bench: Bench, n: int, sent: Sent) -> Sent:
        can_id = bench.specs[name].linux_id
        other = make_encoder(bench.specs[name])([0.05] * 4, bench._counter[name] + 8)
        return [*sent, (name, (can_id, other))] if n % 2 else [(name, (can_id, other)), *sent]

    return spoil


def value(name: str, wrong: Callable[[int, float], float]) -> SpoilValues:
    """One damper's value."""

    def values(bench: Bench, n: int, own: str, right: list[float]) -> list[float]:
        return [wrong(n, v) if own == name and k == bench.corner else v for k, v in enumerate(right)]

    return values


def flipped(frame: Frame) -> Frame:
    return frame[0], bytes([*frame[1][:3], frame[1][3] ^ 0x10, *frame[1][4:]])


def foreign(frame: Frame) -> Frame:
    """The payload of a frame that belongs to another ID."""
    spec = next(spec for spec, _ in input_signals(config()) if spec.name == BODY)
    return frame[0], make_encoder(spec)([0.1] * 4, frame[1][1] & 0xF)


def _lost(name: str, state: State, ms: float, **more: object) -> Fault:
    cause = {VELOCITY: "RELATIVE_VELOCITY", BODY: "BODY_MOTION", TEMPERATURE: "CASE_TEMPERATURE"}[name]
    return Fault(f"{name} lost", state, f"{cause}_MISSING", ms, without(name), **more)  # type: ignore[arg-type]


SUB, LIMP, OFF = State.SUBSTITUTE, State.LIMP, State.OFF
VELOCITY_ID = 0x110
TO_LIMP = {"then": LIMP, "then_ms": 50.0}
FROZEN_MS = 1000.0

FAULTS = (
    _lost(VELOCITY, SUB, 10.0, **TO_LIMP),
    _lost(BODY, SUB, 50.0),
    _lost(TEMPERATURE, SUB, 1000.0, seconds=1.5),
    Fault("all frames lost: plant dead", SUB, "RELATIVE_VELOCITY_MISSING", 10.0,
          without(*ROLE), then=OFF, then_ms=5000.0, seconds=6.0),
    Fault("velocity 30 ms late", SUB, "RELATIVE_VELOCITY_MISSING", 10.0, late(VELOCITY, 15)),
    Fault("velocity in bunches of 8 ms", spoil=bunched(VELOCITY, 4)),
    Fault("velocity repeated", spoil=repeated(VELOCITY), counted="counter"),
    Fault("velocity out of order", spoil=swapped(VELOCITY), counted="counter"),
    Fault("velocity counter stuck", SUB, "RELATIVE_VELOCITY_COUNTER", 10.0, stuck(VELOCITY), **TO_LIMP),
    Fault("body counter stuck", SUB, "BODY_MOTION_COUNTER", 50.0, stuck(BODY)),
    Fault("velocity CRC wrong", SUB, "RELATIVE_VELOCITY_CRC", 10.0, changed(VELOCITY, flipped), **TO_LIMP),
    Fault("body CRC wrong", SUB, "BODY_MOTION_CRC", 50.0, changed(BODY, flipped)),
    Fault("temperature CRC wrong", SUB, "CASE_TEMPERATURE_CRC", 1000.0,
          changed(TEMPERATURE, flipped), seconds=1.5),
    Fault("velocity ID masqueraded", SUB, "RELATIVE_VELOCITY_CRC", 10.0,
          changed(VELOCITY, foreign), **TO_LIMP),
    Fault("velocity sent by two", spoil=second_sender(VELOCITY), counted="counter"),
    Fault("velocity too short", SUB, "RELATIVE_VELOCITY_MALFORMED", 10.0,
          changed(VELOCITY, lambda f: (f[0], f[1][:7])), **TO_LIMP),
    Fault("velocity too long", SUB, "RELATIVE_VELOCITY_MALFORMED", 10.0,
          changed(VELOCITY, lambda f: (f[0], f[1] + b"\0")), **TO_LIMP),
    Fault("velocity as remote frame", SUB, "RELATIVE_VELOCITY_MISSING", 10.0,
          changed(VELOCITY, lambda f: (f[0] | 0x40000000, b"")), counted="remote_frame", **TO_LIMP),
    Fault("velocity as CAN FD frame", SUB, "RELATIVE_VELOCITY_MISSING", 10.0,
          changed(VELOCITY, lambda f: (f[0] | FD_FLAG, f[1])), counted="fd_frame", **TO_LIMP),
    Fault("flood of error frames", spoil=beside((0x20000004, bytes(8)), times=20), counted="error_frame"),
    Fault("babbling rubbish on the velocity ID", spoil=beside((VELOCITY_ID, bytes(8)), times=20),
          counted="crc"),
    Fault("velocity frozen", SUB, "RELATIVE_VELOCITY_FROZEN", FROZEN_MS + 10.0,
          values=value(VELOCITY, lambda _n, _v: 0.15), only=True, seconds=1.5,
          then=LIMP, then_ms=FROZEN_MS + 50.0),
    Fault("body velocity frozen", SUB, "BODY_MOTION_FROZEN", FROZEN_MS + 50.0,
          values=value(BODY, lambda _n, _v: 0.1), only=True, seconds=1.5),
    Fault("velocity jumps and comes back",
          values=value(VELOCITY, lambda n, v: -math.copysign(1.95, v) if n == 1 else v),
          only=True, counted="rate", seconds=0.1),
    Fault("body velocity jumps and comes back", values=value(BODY, lambda n, v: v + (2.0 if n == 1 else 0.0)),
          only=True, counted="rate", seconds=0.1),
    Fault("temperature jumps", SUB, "CASE_TEMPERATURE_RATE", 1000.0,
          values=value(TEMPERATURE, lambda _n, v: v + 60.0), only=True, seconds=1.5),
    Fault("velocity raw value for not available", SUB, "RELATIVE_VELOCITY_NOT_AVAILABLE", 10.0,
          values=value(VELOCITY, lambda _n, _v: math.nan), only=True, **TO_LIMP),
    Fault("body raw value for not available", SUB, "BODY_MOTION_NOT_AVAILABLE", 50.0,
          values=value(BODY, lambda _n, _v: math.nan), only=True),
    Fault("velocity out of range", SUB, "RELATIVE_VELOCITY_RANGE", 10.0,
          values=value(VELOCITY, lambda _n, _v: 2.04), only=True, **TO_LIMP),
    Fault("body velocity out of range", SUB, "BODY_MOTION_RANGE", 50.0,
          values=value(BODY, lambda _n, _v: -4.05), only=True),
    Fault("temperature sensor open", SUB, "CASE_TEMPERATURE_NOT_AVAILABLE", 1000.0,
          values=value(TEMPERATURE, lambda _n, _v: math.nan), only=True, seconds=1.5),
    Fault("temperature sensor shorted", SUB, "CASE_TEMPERATURE_RANGE", 1000.0,
          values=value(TEMPERATURE, lambda _n, _v: 409.5), only=True, seconds=1.5),
)  # fmt: skip


def main() -> None:
    print(
        f"{'fault':<40} {'state':<10} {'ms':>7} {'allowed':>8}  {'cause':<34} {'counted':<14} {'back ms':>8}"
    )
    for fault in FAULTS:
        done = [Bench(fault, corner).run() for corner in (ALL if fault.only else (0,))]
        bench = done[0]
        state = fault.state.name if fault.state is not None else "ACTIVE"
        took = max(b.reached_after(fault.state) for b in done) if fault.state is not None else 0.0
        counted = f"{fault.counted} {bench.tick.rejected[fault.counted]}" if fault.counted else ""
        back = max(b.recovered_after() for b in done)
        print(
            f"{fault.name:<40} {state:<10} {took:>7.0f} {fault.within_ms + 2.0:>8.0f}  "
            f"{', '.join(sorted(bench.causes())):<34} {counted:<14} {back:>8.0f}"
        )


if __name__ == "__main__":
    main()
