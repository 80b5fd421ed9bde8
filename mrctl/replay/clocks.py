"""When the ticks of a replay are, and which frames belong to each: two clocks, functions of the log alone.

Grid: the controller starts at a moment; tick n is due n periods later and takes the frames that arrived up to
then, the stamp of the due time included. So does the live loop when it is never late.

Recorded: the log has the controller's own commands. Each closes a tick: what stands before it in the log
was known to it. The periods from one command to the next follow from their stamps, the ticks that ran in
between from their counter: a counter that goes up by 1 over several periods tells that the loop skipped them,
one that goes up by more that commands are missing in the log.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from mrctl.can import e2e
from mrctl.replay.differences import Differences
from mrctl.replay.player import Player
from mrctl.replay.rows import NANOSECONDS
from mrctl.replay.source import Frames
from mrctl.runtime.tick import Frame

# So long without a command in the log, the controller that recorded them is taken for gone.
GONE_AFTER_NS: Final = 5 * NANOSECONDS
# How fast two clocks may drift apart; NTP slews by half of it.
_DRIFT: Final = 1e-3


def run_on_grid(parts: Iterable[Frames], player: Player, differences: Differences, start_ns: int) -> None:
    """Replay with tick n due n periods after start_ns; frames before start_ns belong to the first tick."""
    step, period = player.step, player.period_ns
    command_id, state_id = differences.command.linux_id, differences.state.linux_id
    due = start_ns + period
    waiting: list[Frame] = []
    compare = False
    for part in parts:
        for time_ns, can_id, data in part:
            while time_ns > due:
                step(waiting, due)
                waiting = []
                due += period
                if compare and player.sent is not None:
                    differences.re_created(player.sent)
            if can_id == command_id:
                compare = True
                differences.command_near(time_ns, data)
            elif can_id == state_id:
                differences.state_at(time_ns, data)
            elif can_id not in player.sent_ids:
                waiting.append((can_id, data))
    for _ in range(1 + differences.tolerance_ticks if compare else 1):
        step(waiting, due)
        waiting = []
        due += period
        if compare and player.sent is not None:
            differences.re_created(player.sent)


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a recorded controller's ticks begin: its start, and whether that is in the log."""

    start_ns: int
    started_in_log: bool


def origin(frames: Frames, player: Player, first_ns: int) -> Origin | None:
    """The origin by the first command among these frames; None without one."""
    span = player.period_ns * player.command_every
    for time_ns, can_id, data in frames:
        if can_id == player.command_id and len(data) >= 2:
            # The first command of a controller has counter 1, and no current yet.
            if e2e.counter_of(data) == 1 and not any(data[2:]) and not data[1] >> 4:
                return Origin(time_ns - span, started_in_log=True)
            spans = max(1, -(-(time_ns - first_ns) // span))
            return Origin(time_ns - spans * span, started_in_log=False)
    return None


class RecordedClock:
    """Ticks as the commands in the log tell."""

    def __init__(
        self, player: Player, differences: Differences, begin: Origin, opened_before_ns: int, latency_ns: int
    ) -> None:
        """opened_before_ns: so long before its start a controller found in the log had its bus open.

        latency_ns: a command answers what arrived at least so long before it.
        """
        self._player = player
        self._differences = differences
        self._begin = begin
        self._from_ns = begin.start_ns - (opened_before_ns if begin.started_in_log else 0)
        self._latency_ns = latency_ns
        self._drift_ns = round(_DRIFT * player.period_ns)
        self._due_ns = begin.start_ns  # of the tick that ran last
        self._counter: int | None = None
        self._waiting: Frames = []
        self.too_early = 0

    def run(self, parts: Iterable[Frames]) -> None:
        """Replay all."""
        command_id, state_id = self._differences.command.linux_id, self._differences.state.linux_id
        sent_ids = self._player.sent_ids
        add, gone_ns = self._waiting.append, self._due_ns + GONE_AFTER_NS
        for part in parts:
            for frame in part:
                can_id = frame[1]
                if can_id == command_id:
                    self._command(frame[0], frame[2])
                    add, gone_ns = self._waiting.append, self._due_ns + GONE_AFTER_NS
                elif can_id == state_id:
                    self._differences.state_at(frame[0], frame[2])
                elif frame[0] < self._from_ns:
                    self.too_early += 1
                elif can_id not in sent_ids:
                    if frame[0] > gone_ns:
                        self._on_grid(frame[0])
                        self._counter = None
                        add, gone_ns = self._waiting.append, self._due_ns + GONE_AFTER_NS
                    add(frame)
        if self._waiting:
            self._on_grid(self._waiting[-1][0] + self._player.period_ns)  # every frame goes through

    def _command(self, time_ns: int, data: bytes) -> None:
        """The ticks up to the one that sent this command, and that one."""
        player, period, every = self._player, self._player.period_ns, self._player.command_every
        counter = data[1] & 0xF if len(data) > 1 else 0
        late_ns = time_ns - self._due_ns - period
        if every == 1 and 0 <= late_ns < period and self._counter == (counter - 1) & 0xF:  # nearly always
            self._counter = counter
            self._due_ns += period + min(late_ns, self._drift_ns)
            player.step(self._taken(time_ns - self._latency_ns), time_ns)
            differences = self._differences
            if data == player.sent and time_ns >= differences.settled_ns and differences.shut_down_ns is None:
                differences.same += 1
            else:
                differences.command_at(time_ns, data, player.sent)
            return
        if counter == self._counter and late_ns < -period // 2:  # the same line twice
            self._differences.damaged += 1
            return
        periods, ticks = self._ticks_until(time_ns, counter)
        self._counter = counter
        for _ in range(ticks - 1):
            self._due_ns += period
            player.step(self._taken(self._due_ns), self._due_ns)
        left = periods - (ticks - 1)
        # Commands leave late or later: their earliest stamps tell when ticks are due.
        self._due_ns = min(self._due_ns + left * period + round(_DRIFT * periods * period), time_ns)
        player.step(self._taken(time_ns - self._latency_ns), time_ns, left)
        self._differences.command_at(time_ns, data, player.sent)

    def _ticks_until(self, time_ns: int, counter: int) -> tuple[int, int]:
        """Periods up to the command with this counter, and the ticks that ran in them."""
        period, every = self._player.period_ns, self._player.command_every
        to_command = every - self._player.tick.now % every  # the tick that sends one, if none is skipped
        if self._counter is None:  # the first, or the first since they were gone
            periods = max(1, round((time_ns - self._due_ns) / period))
            periods += (to_command - periods) % every
            return periods, periods
        periods = max(1, (time_ns - self._due_ns) // period)
        commands = e2e.counter_delta(counter, self._counter) or e2e.COUNTERS
        if commands == 1:
            return max(periods, to_command), to_command
        ticks = to_command + (commands - 1) * every
        turn = e2e.COUNTERS * every
        if ticks >= periods or (periods - ticks) % turn == 0 or periods > turn:  # the bus was down, say
            periods += (to_command - periods) % every
            return periods, periods
        return periods, ticks

    def _on_grid(self, until_ns: int) -> None:
        """Ticks at their due times, as far as this."""
        player, period = self._player, self._player.period_ns
        while self._due_ns + period <= until_ns:
            self._due_ns += period
            player.step(self._taken(self._due_ns), self._due_ns)

    def _taken(self, until_ns: int) -> list[Frame]:
        """The waiting frames that had arrived by then."""
        waiting = self._waiting
        if not waiting or waiting[-1][0] <= until_ns:
            self._waiting = []
            return [(can_id, data) for _, can_id, data in waiting]
        taken = [(can_id, data) for time_ns, can_id, data in waiting if time_ns <= until_ns]
        self._waiting = waiting[len(taken) :]
        return taken
