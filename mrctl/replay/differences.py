"""Re-created commands against those in the log: what differs, and by how much."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from mrctl.can import e2e
from mrctl.can.codec import make_decoder
from mrctl.can.frames import CAUSE_CODE, STATE_SIGNALS
from mrctl.can.specs import FrameSpec

# Commands on a grid that nobody recorded may be off by so many ticks.
GRID_TOLERANCE_TICKS = 1


@dataclass(slots=True)
class Tally:
    """How commands compare. A command differs when a current does, by a count of the DBC or more."""

    compared: int = 0
    same_bytes: int = 0
    differing: int = 0
    largest_a: float = 0.0
    first_differing_ns: int | None = None

    def add(self, other: Tally) -> None:
        """Take in another one, later in time."""
        self.compared += other.compared
        self.same_bytes += other.same_bytes
        self.differing += other.differing
        self.largest_a = max(self.largest_a, other.largest_a)
        if self.first_differing_ns is None:
            self.first_differing_ns = other.first_differing_ns


class Differences:
    """Compares; what cannot be known from a log is left out and counted.

    * A controller that was running before the log began had a state that is not in the log: commands before
      `settled_ns` are left out.
    * When somebody stopped the controller is not in the log, only that it was stopped: commands after the
      last state frame before it are left out.
    """

    def __init__(self, command: FrameSpec, state: FrameSpec) -> None:
        self.command = command
        self.state = state
        self.settled_ns = 0
        self.tally = Tally()
        self.unsettled = 0
        self.after_shut_down = 0
        self.damaged = 0
        self.shut_down_ns: int | None = None
        self._decode = make_decoder(command)
        self._decode_state = make_decoder(state)
        names = [signal.name.partition("_")[0] for signal in state.signals]
        self._causes = [k for k, name in enumerate(names) if name == STATE_SIGNALS[1]]
        self._open = Tally()  # since the last state frame
        self.same = 0  # commands in it that were the same, of those that need no further look
        self.tolerance_ticks = 0
        self._recent: deque[bytes] = deque(maxlen=1)
        self._waiting: deque[tuple[int, int, bytes]] = deque()
        self._ticks = 0

    def tolerate(self, ticks: int) -> None:
        """From now on a command is compared with those of so many ticks before and after, too."""
        self.tolerance_ticks = ticks
        self._recent = deque(maxlen=2 * ticks + 1)

    def command_at(self, time_ns: int, recorded: bytes, sent: bytes | None) -> None:
        """A recorded command, and the one that was re-created for its tick."""
        if time_ns < self.settled_ns:
            self.unsettled += 1
        elif self.shut_down_ns is not None:
            self.after_shut_down += 1
        elif sent is not None:
            self._compare(time_ns, recorded, (sent,))

    def command_near(self, time_ns: int, recorded: bytes) -> None:
        """A recorded command of the last tick, to be compared when the ticks after it are known."""
        self._waiting.append((self._ticks + self.tolerance_ticks, time_ns, recorded))

    def re_created(self, sent: bytes) -> None:
        """A command left; the recorded ones that have waited for it are compared with it and those before."""
        self._ticks += 1
        self._recent.append(sent)
        while self._waiting and self._waiting[0][0] <= self._ticks:
            _, time_ns, recorded = self._waiting.popleft()
            if time_ns < self.settled_ns:
                self.unsettled += 1
            elif self.shut_down_ns is not None:
                self.after_shut_down += 1
            else:
                self._compare(time_ns, recorded, tuple(self._recent))

    def state_at(self, time_ns: int, data: bytes) -> None:
        """A recorded state frame: what came before it was no shut-down, or it was."""
        if len(data) != self.state.length or not e2e.check(data, self.state.data_ids):
            return
        self._fold()
        values = self._decode_state(data)
        if any(values[k] == CAUSE_CODE["SHUTDOWN"] for k in self._causes):
            if self.shut_down_ns is None:
                self.shut_down_ns = time_ns
                self.after_shut_down += self._open.compared
        else:
            self.shut_down_ns = None
            self.tally.add(self._open)
        self._open = Tally()

    def finish(self) -> None:
        """The log is over."""
        self._fold()
        if self.shut_down_ns is None:
            self.tally.add(self._open)
        self._open = Tally()

    def _fold(self) -> None:
        self._open.compared += self.same
        self._open.same_bytes += self.same
        self.same = 0

    def _compare(self, time_ns: int, recorded: bytes, candidates: tuple[bytes, ...]) -> None:
        tally = self._open
        if recorded in candidates:
            tally.compared += 1
            tally.same_bytes += 1
            return
        if len(recorded) != self.command.length or not e2e.check(recorded, self.command.data_ids):
            self.damaged += 1
            return
        tally.compared += 1
        currents = self._decode(recorded)
        apart = min(_apart(currents, self._decode(sent)) for sent in candidates)
        if apart > 0.0:
            tally.differing += 1
            tally.largest_a = max(tally.largest_a, apart)
            if tally.first_differing_ns is None:
                tally.first_differing_ns = time_ns


def _apart(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """The largest difference in A; "not available" counts as no current."""
    pairs = zip(one, other, strict=True)
    return max((abs((0.0 if math.isnan(a) else a) - (0.0 if math.isnan(b) else b)) for a, b in pairs))
