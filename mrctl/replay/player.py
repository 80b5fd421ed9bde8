"""The controller in a replay: the tick that runs live, what it sends, and how its states pass."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Final

from mrctl.can.frames import State
from mrctl.can.ports import FRAMES_PER_CALL
from mrctl.runtime.tick import Frame, LoopFigures, StateChange, Tick, TickPlan

CHANGES_KEPT: Final = 200

Writer = Callable[[int, Sequence[Frame]], None]
Observer = Callable[[int, Tick], None]


def sent_ids(plan: TickPlan) -> frozenset[int]:
    """The identifiers of what the controller sends."""
    outputs = (plan.command, plan.state, plan.health, *(spec for spec, _ in plan.figures))
    return frozenset(spec.linux_id for spec in outputs)


class Player:
    """Steps the tick; `sent` is the command that left in the last step, or None.

    The health frames say what a loop that is never late says: nobody can know from a log how late it was.
    """

    def __init__(
        self, plan: TickPlan, writer: Writer | None = None, observer: Observer | None = None
    ) -> None:
        """writer: gets time and frames of every tick that sends; observer: looks at the tick after each."""
        self.tick = Tick(plan)
        self.command_id = plan.command.linux_id
        self.sent_ids = sent_ids(plan)
        self.command_every = plan.command_every
        self.period_ns = round(1e9 * plan.dt_s)
        self.ticks = 0
        self.skipped = 0
        self.commands = 0
        self.sent: bytes | None = None
        self.changes: list[tuple[int, StateChange]] = []
        self.changed = 0
        self._writer, self._observer = writer, observer
        self._window = max(1, round(1.0 / plan.dt_s))
        self._figures = LoopFigures()
        self._left: list[Frame] = []
        self._step = self.tick.step
        self._since = [(corner.name, corner.state, 0) for corner in self.tick.corners]
        self._in_state: Counter[tuple[str, State]] = Counter()

    def step(self, frames: list[Frame], now_ns: int, periods: int = 1) -> None:
        """One tick with these frames, at this time, so many periods after the one before."""
        if self._left or len(frames) > FRAMES_PER_CALL:  # as a port gives them
            frames = self._left + frames
            frames, self._left = frames[:FRAMES_PER_CALL], frames[FRAMES_PER_CALL:]
        out = self._step(frames, periods, self._figures)
        self.ticks += 1
        self.sent = None
        if out:
            command_id = self.command_id
            for can_id, data in out:
                if can_id == command_id:
                    self.commands += 1
                    self.sent = data
            if self._writer is not None:
                self._writer(now_ns, out)
        if periods > 1:
            self.skipped += periods - 1
        if self.skipped and self.ticks % self._window == 0:
            self._figures = self._figures._replace(skipped=self.skipped)
        if self.tick.changes:
            self._note_changes(now_ns)
        if self._observer is not None:
            self._observer(now_ns, self.tick)

    def seconds_in_state(self) -> dict[str, dict[str, float]]:
        """For each damper, how long it was in each state, in s."""
        spent = self._in_state.copy()
        for name, state, since in self._since:
            spent[name, state] += self.tick.now - since
        dt_s = self.period_ns / 1e9
        return {
            name: {state.name: round(spent[name, state] * dt_s, 9) for state in State if spent[name, state]}
            for name, _, _ in self._since
        }

    def _note_changes(self, now_ns: int) -> None:
        for change in self.tick.changes:
            self.changed += 1
            if len(self.changes) < CHANGES_KEPT:
                self.changes.append((now_ns, change))
            for k, (name, state, since) in enumerate(self._since):
                if name == change.damper:
                    self._in_state[name, state] += change.tick - since
                    self._since[k] = (name, change.after, change.tick)
        self.tick.changes.clear()
