"""The tick: frames in, frames out, a function of its state, the frames and the periods elapsed.

No clock and no I/O: live and replay run this same code, and the loop (loop.py) or the reader of a log decides
which frames belong to a tick.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from mrctl.can.codec import make_encoder, make_raw_encoder
from mrctl.can.frames import CAUSE_CODE, State
from mrctl.can.specs import ERROR_FLAG, FD_FLAG, REMOTE_FLAG, FrameSpec
from mrctl.runtime.channel import Channel, ChannelRules, Fault
from mrctl.runtime.compiled import receiver_kind
from mrctl.runtime.corner import Corner, CornerPlan
from mrctl.runtime.guard import OutputGuard
from mrctl.runtime.outgoing import Frame, LoopFigures, Sender, SlowFrames
from mrctl.runtime.receiver import FrameReceiver

__all__ = ["CAUSE_SOURCE", "Frame", "LoopFigures", "StateChange", "Tick", "TickPlan"]

# Signal roles, and the names under which their faults go onto the bus.
CAUSE_SOURCE = {
    "relative_velocity": "RELATIVE_VELOCITY",
    "body_velocity": "BODY_MOTION",
    "body_acceleration": "BODY_MOTION",
    "temperature": "CASE_TEMPERATURE",
    "force_wish": "FORCE_WISH",
}
_NEAREST: Final = (("_FROZEN", "_RATE"), ("DISPLACEMENT_", "RELATIVE_VELOCITY_"))
# The bus has no code for "nobody there": to its readers, the first input is missing.
_SILENT_CODE: Final = CAUSE_CODE["RELATIVE_VELOCITY_MISSING"]


class StateChange(NamedTuple):
    """One damper went into another state."""

    tick: int
    damper: str
    before: State
    after: State
    cause: str


@dataclass(frozen=True, slots=True)
class TickPlan:
    """All that the tick is built from.

    frames_in: spec and, signal by signal, the (damper index, role) pairs that it feeds. The frames that go
    out, each with the number of ticks from one to the next; figures: HealthTiming, HealthRejects or neither.
    """

    dt_s: float
    corners: tuple[CornerPlan, ...]
    rules: Mapping[str, ChannelRules]
    start_values: Mapping[str, float]  # by role: what a signal is taken for before it is known
    frames_in: Sequence[tuple[FrameSpec, Sequence[Sequence[tuple[int, str]]]]]
    command: FrameSpec
    command_every: int
    state: FrameSpec
    state_every: int
    health: FrameSpec
    health_every: int
    good_frames: int
    init_timeout_s: float
    bus_silent_off_s: float
    figures: tuple[tuple[FrameSpec, int], ...] = ()


class Tick:
    """The controller of all dampers."""

    def __init__(self, plan: TickPlan) -> None:
        """Raises ValueError or FilterError when a part of the plan cannot work at this step."""
        dt = plan.dt_s
        self._plan = plan
        self.now = 0
        self.rejected: Counter[str] = Counter()
        self.foreign = 0  # frames with IDs that are none of ours
        self.changes: list[StateChange] = []  # for the log; whoever reads them clears them
        self.at_rest = False  # whether the command that left last was 0 A for every damper
        self._off: str | None = None
        self._last_good = 0
        self._init_ticks = self._init_until = round(plan.init_timeout_s / dt)
        self._silent_ticks = round(plan.bus_silent_off_s / dt)
        roles: list[set[str]] = [set() for _ in plan.corners]
        for _, signals in plan.frames_in:
            for of_signal in signals:
                for corner, role in of_signal:
                    roles[corner].add(role)
        channels = [
            {
                role: Channel(plan.rules[role], dt, plan.good_frames, plan.start_values.get(role, 0.0))
                for role in of_corner
            }
            for of_corner in roles
        ]
        self.corners = tuple(Corner(c, own, dt) for c, own in zip(plan.corners, channels, strict=True))
        make_receiver = receiver_kind()
        self.receivers: dict[int, FrameReceiver] = {
            spec.linux_id: make_receiver(
                spec,
                [[channels[c][role] for c, role in of_signal] for of_signal in signals],
                self.rejected,
                dt,
            )
            for spec, signals in plan.frames_in
        }
        unit = plan.command.signals[0].factor
        self.guards = tuple(
            OutputGuard(c.current_max_a, c.slew_a_s, dt, c.limp_current_a, unit) for c in plan.corners
        )
        self._guarded_corners = tuple(
            (k, *pair) for k, pair in enumerate(zip(self.corners, self.guards, strict=True))
        )
        self._counts = [0] * len(plan.corners)  # the currents that may leave, as the guards count
        # A guard's count is the frame's own where signal and guard count alike.
        self._unit_a = unit
        self._in_counts = all(
            (signal.factor, signal.offset) == (unit, 0.0)
            and signal.raw_minimum <= 0
            and guard.maximum <= signal.raw_maximum
            for signal, guard in zip(plan.command.signals, self.guards, strict=True)
        )
        encode = make_raw_encoder(plan.command) if self._in_counts else make_encoder(plan.command)
        self._command = Sender(plan.command, plan.command_every, encode=encode)
        self._slow = SlowFrames(
            (plan.state, plan.state_every),
            (plan.health, plan.health_every),
            plan.figures,
            dt,
            self._state_values,
            self.rejected,
        )
        self._states = [corner.state for corner in self.corners]

    @property
    def wanted_ids(self) -> tuple[int, ...]:
        """The CAN IDs that the tick listens to, with the extended flag where they have it."""
        return tuple(self.receivers)

    def shut_down(self) -> None:
        """From now on every damper is OFF: its current is ramped to 0 A and stays there."""
        self._off = "SHUTDOWN"
        self.at_rest = False  # one more command leaves, even where all are 0 A already

    def step(
        self, frames: Iterable[Frame], periods: int = 1, figures: LoopFigures | None = None
    ) -> list[Frame]:
        """Advance by one tick; returns the frames to send.

        frames: all that arrived since the last tick, oldest first. periods: loop periods since then, more
        than 1 when ticks were skipped. figures: for the health frame.
        """
        now = self.now = self.now + periods
        receivers = self.receivers
        for can_id, data in frames:
            receiver = receivers.get(can_id)
            if receiver is None:
                self._count_stray(can_id)
            elif receiver.take(data, now):
                self._last_good = now
        off = self._off
        if off is None and now - self._last_good > self._silent_ticks:
            off = "BUS_SILENT"
            self._init_until = now + self._init_ticks  # once the bus is back, its signals must show first
        starting = now <= self._init_until
        states, counts = self._states, self._counts
        for index, corner, guard in self._guarded_corners:
            wanted = corner.step(now, periods, starting, off)
            corner.issued(guard.apply(wanted, corner.made_in, now))
            counts[index] = guard.raw
            if corner.state is not states[index]:
                self._note_change(index, corner)
        out = []
        if now >= self._command.next:
            values = counts if self._in_counts else [count * self._unit_a for count in counts]
            out.append(self._command.frame(now, values))
            self.at_rest = not any(counts)
        if now >= self._slow.next:
            out += self._slow.due(now, figures or LoopFigures())
        return out

    def cause_of(self, corner: Corner) -> str:
        """The cause of a damper's state, in words of the DBC where it has one."""
        source, fault = corner.cause
        return source if fault is Fault.NONE else f"{CAUSE_SOURCE.get(source, source.upper())}_{fault.name}"

    def _cause_code(self, corner: Corner) -> int:
        cause = self.cause_of(corner)
        for said, nearest in _NEAREST:  # the bus has no codes of their own for these
            cause = cause.replace(said, nearest)
        return CAUSE_CODE.get(cause, _SILENT_CODE)

    def _state_values(self) -> list[float]:
        corners, guarded = self.corners, [guard.stepped_in for guard in self.guards]
        for guard in self.guards:
            guard.stepped_in = False  # until the next state frame
        return [
            *(corner.state for corner in corners),
            *(self._cause_code(corner) for corner in corners),
            *(corner.clamped for corner in corners),
            *(corner.saturated for corner in corners),
            *guarded,
        ]

    def _note_change(self, index: int, corner: Corner) -> None:
        before, self._states[index] = self._states[index], corner.state
        cause = self.cause_of(corner)
        self.changes.append(
            StateChange(self.now, self._plan.corners[index].name, before, corner.state, cause)
        )

    def _count_stray(self, can_id: int) -> None:
        if can_id & ERROR_FLAG:
            self.rejected["error_frame"] += 1
        elif can_id & REMOTE_FLAG:
            self.rejected["remote_frame"] += 1
        elif can_id & FD_FLAG:
            self.rejected["fd_frame"] += 1
        else:
            self.foreign += 1
