"""The rules, held against frames one after the other.

length    a command has the DBC's length, and is a plain data frame
crc       its CRC fits content, counter and data ID
counter   its counter is the last one's successor
finite    a current is there: none says "not available"
range     a current is within 0 and the largest
slew      from one command to the next it moves by no more than the slew limit allows
cycle     commands come in their cycle: none too late, and on the mean neither too fast nor too slow
timeout   with its input gone, a current goes to the limp current or to 0 A; with all inputs gone, to 0 A
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass
from typing import NamedTuple

from mrctl.judge.e2e import expected_crc
from mrctl.judge.frames import Bus, Frame, Signal
from mrctl.judge.limits import Limits

RULES = ("length", "crc", "counter", "finite", "range", "slew", "cycle", "timeout")
MEAN_OVER = 100
# Commands after an input's time-out in which the current must be on its way.
GRACE_CYCLES = 3
# An input frame is taken up to so many steps of its counter; more is an old or a foreign one.
INPUT_STEPS_MAX = 5
# A silence of so many cycles ends what is known of counter and current.
FORGET_CYCLES = 10
# Frames of a log may be out of order by so much; a clock that goes back by more was set.
OUT_OF_ORDER_S = 0.02
_NOT_PLAIN = 1 << 32 | 1 << 30  # CAN FD, remote


class Violation(NamedTuple):
    """One rule broken: when, by which frame or signal, what was there and what may be."""

    time_s: float
    frame: str
    rule: str
    value: str
    limit: str

    def __str__(self) -> str:
        """One line."""
        return f"{self.time_s:.6f} {self.frame} {self.rule}: {self.value}, limit {self.limit}"


@dataclass(slots=True)
class _Input:
    """What has been heard of one input frame."""

    frame: Frame
    counter: int | None = None


class Judge:
    """Feed it every frame of the bus; it returns what is broken, and counts."""

    def __init__(self, bus: Bus, limits: Limits) -> None:
        self.frames = 0
        self.commands = 0
        self.broken: Counter[str] = Counter()
        self._command = bus.command
        self._limits = limits
        self._inputs = {frame.identifier: _Input(frame) for frame in bus.inputs}
        self._heard: dict[str, float] = {}  # when an input signal was last there
        self._heard_any: float | None = None
        self._counter: int | None = None
        self._before: dict[str, float] = {}
        self._last_s: float | None = None
        self._gaps: deque[float] = deque(maxlen=MEAN_OVER)
        self._mean_said = False
        self._found: list[Violation] = []
        self._began_s: float | None = None
        self._now_s: float | None = None

    def see(self, time_s: float, identifier: int, data: bytes) -> list[Violation]:
        """One frame: what it breaks, mostly nothing.

        identifier: as Linux has it, bits 31 extended, 30 remote frame, 29 error frame; more for CAN FD.
        """
        self.frames += 1
        if self._began_s is None:
            self._began_s = time_s
        if self._now_s is not None and time_s < self._now_s - OUT_OF_ORDER_S:
            self._set_clock(time_s - self._now_s)
        self._now_s = time_s
        if identifier == self._command.identifier:
            self._judge_command(time_s, data)
        elif identifier in self._inputs:
            self._listen(self._inputs[identifier], time_s, data)
        elif identifier & _NOT_PLAIN and identifier & ~_NOT_PLAIN == self._command.identifier:
            self._say(time_s, self._command.name, "length", "a remote or CAN FD frame", "a plain data frame")
        if not self._found:
            return []
        found, self._found = self._found, []
        return found

    def silence(self, time_s: float) -> list[Violation]:
        """Nothing has come until now: is a command overdue? For a bus; a log's next frame tells it."""
        if (
            self._last_s is not None
            and time_s - self._last_s > self._limits.late_cycles * self._limits.cycle_s
        ):
            self._late(time_s, time_s - self._last_s)
            self._last_s = None
            self._gaps.clear()
        found, self._found = self._found, []
        return found

    def _set_clock(self, by_s: float) -> None:
        """The clock was set back: what is known goes over to the new one, on which time goes on."""
        self._heard = {name: time_s + by_s for name, time_s in self._heard.items()}
        self._began_s, self._heard_any, self._last_s = (
            None if time_s is None else time_s + by_s
            for time_s in (self._began_s, self._heard_any, self._last_s)
        )

    def _say(self, time_s: float, frame: str, rule: str, value: str, limit: str) -> None:
        self.broken[rule] += 1
        self._found.append(Violation(time_s, frame, rule, value, limit))

    def _late(self, time_s: float, gap_s: float) -> None:
        limit = self._limits.late_cycles * self._limits.cycle_s
        self._say(
            time_s,
            self._command.name,
            "cycle",
            f"{1e3 * gap_s:.3f} ms without a command",
            f"{1e3 * limit:g} ms",
        )

    def _judge_command(self, time_s: float, data: bytes) -> None:
        command = self._command
        self.commands += 1
        gap_s = None if self._last_s is None else time_s - self._last_s
        self._last_s = time_s
        if gap_s is not None:
            self._judge_cycle(time_s, gap_s)
        if len(data) != command.length:
            self._say(time_s, command.name, "length", f"{len(data)} bytes", f"{command.length} bytes")
            return
        crc = expected_crc(data, command.data_ids)
        if data[0] != crc:
            self._say(time_s, command.name, "crc", f"0x{data[0]:02X}", f"0x{crc:02X}")
            return  # nobody takes its content, so there is nothing to judge in it
        forgotten = gap_s is None or gap_s > FORGET_CYCLES * self._limits.cycle_s
        counter, steps = data[1] % 16, 1
        if self._counter is not None and not forgotten:
            steps = (counter - self._counter) % 16
            if steps != 1:
                self._say(time_s, command.name, "counter", str(counter), str((self._counter + 1) % 16))
        self._counter = counter
        word = int.from_bytes(data, "little")
        moving_s = gap_s if forgotten and gap_s is not None else max(1, steps) * self._limits.cycle_s
        for signal in command.signals:
            self._judge_current(time_s, signal, word, moving_s)

    def _judge_cycle(self, time_s: float, gap_s: float) -> None:
        limits = self._limits
        if gap_s > limits.late_cycles * limits.cycle_s:
            self._late(time_s, gap_s)
            self._gaps.clear()
            return
        self._gaps.append(gap_s)
        if len(self._gaps) == MEAN_OVER:
            mean_s = sum(self._gaps) / MEAN_OVER
            off = abs(mean_s - limits.cycle_s) > limits.mean_tolerance * limits.cycle_s
            if off and not self._mean_said:
                low, high = (1e3 * limits.cycle_s * (1 + sign * limits.mean_tolerance) for sign in (-1, 1))
                value = f"{1e3 * mean_s:.4f} ms, mean of {MEAN_OVER}"
                self._say(time_s, self._command.name, "cycle", value, f"{low:g} to {high:g} ms")
            self._mean_said = off

    def _judge_current(self, time_s: float, signal: Signal, word: int, moving_s: float) -> None:
        limits, name = self._limits, signal.name
        raw = signal.raw(word)
        if raw == signal.not_available:
            self._say(time_s, name, "finite", "not available", "a current")
            self._before.pop(name, None)
            return
        current, count = raw * signal.factor + signal.offset, abs(signal.factor)
        largest = limits.current_max_a.get(name, signal.maximum)
        if current < -count / 2 or (largest is not None and current > largest + count / 2):
            self._say(time_s, name, "range", f"{current:.4g} A", f"0 to {largest:g} A")
        before, slew = self._before.get(name), limits.slew_a_s.get(name)
        self._before[name] = current
        if before is not None and slew is not None:
            allowed = slew * moving_s
            if abs(current - before) > allowed + count / 2:
                value = f"{current - before:+.4g} A in {1e3 * moving_s:.4g} ms"
                self._say(time_s, name, "slew", value, f"{allowed:.4g} A")
        self._judge_timeout(time_s, signal, current, before)

    def _judge_timeout(self, time_s: float, signal: Signal, current: float, before: float | None) -> None:
        limits, tolerance = self._limits, 1.5 * abs(signal.factor)
        began_s = self._began_s or 0.0
        grace_s = GRACE_CYCLES * limits.cycle_s
        silent_s = time_s - (began_s if self._heard_any is None else self._heard_any)
        if silent_s > limits.off_after_s + limits.ramp_s + grace_s and current > tolerance:
            value = f"{current:.4g} A, {silent_s:.4g} s without any input"
            self._say(time_s, signal.name, "timeout", value, f"0 A after {limits.off_after_s:g} s")
            return
        needed = limits.safe_after.get(signal.name)
        if needed is None:
            return
        name, after_s = needed
        gone_s = time_s - self._heard.get(name, began_s)
        slew = limits.slew_a_s.get(signal.name)
        largest = limits.current_max_a.get(signal.name, signal.maximum) or 0.0
        way_s = (
            limits.ramp_s if slew is None else 1.2 * largest / slew
        )  # whole counts a tick: a little slower
        if gone_s <= after_s + way_s + grace_s:
            return
        at_rest = abs(current - limits.limp_a) <= tolerance or current <= tolerance
        # From one to the other, at the end of the start-up time and when it is shut down.
        on_its_way = (
            before is not None and current != before and max(current, before) < limits.limp_a + tolerance
        )
        if at_rest or on_its_way:
            return
        value = f"{current:.4g} A, {gone_s:.4g} s without {name}"
        self._say(time_s, signal.name, "timeout", value, f"{limits.limp_a:g} or 0 A after {after_s:g} s")

    def _listen(self, known: _Input, time_s: float, data: bytes) -> None:
        """An input frame: note which of its signals are there."""
        frame = known.frame
        if len(data) != frame.length or data[0] != expected_crc(data, frame.data_ids):
            return
        counter = data[1] % 16
        steps = 1 if known.counter is None else (counter - known.counter) % 16
        if steps:
            known.counter = counter
        if not 1 <= steps <= INPUT_STEPS_MAX:
            return
        self._heard_any = time_s
        word = int.from_bytes(data, "little")
        for signal in frame.signals:
            raw = signal.raw(word)
            if raw == signal.not_available:
                continue
            value = raw * signal.factor + signal.offset
            low, high = self._limits.input_range.get(signal.name, (value, value))
            if low <= value <= high:
                self._heard[signal.name] = time_s
