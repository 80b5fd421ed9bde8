"""A log as the controller's bus: one interface, frames in the order of time, a clock that never goes back.

* Order: frames whose stamps are out of order by at most ORDER_WINDOW_NS are sorted by stamp, equal stamps in
  the order of the file.
* A clock that steps back by more: time goes on from the last frame before it. One frame alone with a stamp
  that does not fit takes the time of the frame before it.
* A gap is lived through as the live controller would have, up to GAP_MAX_NS: by then every damper is at rest.
  Of a longer one (the recorder was off, its clock was set) the rest is cut out.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Final

from mrctl.can import linux
from mrctl.can.specs import ERROR_FLAG, EXTENDED_FLAG, FD_FLAG, REMOTE_FLAG
from mrctl.errors import InputError
from mrctl.replay.candump import CandumpReader
from mrctl.replay.other_logs import MDF_SUFFIXES, PYTHON_CAN_READERS, MdfReader, PythonCanReader
from mrctl.replay.rows import NANOSECONDS, LogReader, Part

ORDER_WINDOW_NS: Final = 20_000_000
GAP_MAX_NS: Final = 60 * NANOSECONDS

# Rows that are looked at to choose the interface.
_PEEK_ROWS: Final = 4000
# Kinds of error frames that a live port asks the kernel for.
_ERRORS_TOLD: Final = linux.ERR_CONTROLLER | linux.ERR_BUS_OFF | linux.ERR_RESTARTED
_PLAIN_ID: Final = EXTENDED_FLAG | 0x1FFFFFFF

Frames = list[tuple[int, int, bytes]]
"""Time in ns, CAN ID with flags, payload."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What the controller has to do with: identifiers that it reads and sends, and its channel."""

    read: frozenset[int]
    sent: frozenset[int]
    channel: str
    fd: bool


@dataclass(slots=True)
class Counts:
    """What was in the log."""

    frames: int = 0
    used: int = 0
    own: int = 0
    """Frames that the controller itself sent."""
    foreign: int = 0
    other_interfaces: int = 0
    bus_off: int = 0
    steps_back: int = 0
    gaps_cut: int = 0
    cut_s: float = 0.0
    wrong_stamps: int = 0
    sorted: int = 0
    rejected: Counter[str] = field(default_factory=Counter)
    """Frames that the live controller's port would not have handed on, by reason."""


def open_log(path: Path, stamps: str = "auto") -> LogReader:
    """The reader for a file, by its suffix. Raises InputError where it cannot be opened."""
    suffix = path.suffix.lower()
    if path.is_dir():
        raise InputError.at(path, "is a folder", "name the logs in it")
    if suffix in PYTHON_CAN_READERS:
        return PythonCanReader(path)
    if suffix in MDF_SUFFIXES:
        return MdfReader(path)
    return CandumpReader(path, stamps)


class LogSource:
    """The frames of one log that matter to the controller, once, in the order of time."""

    def __init__(self, path: Path, reader: LogReader, wanted: Wanted, interface: str | None = None) -> None:
        """interface: the name of the log's interface; None finds it."""
        self.counts = Counts()
        self.notes: list[str] = []
        self.interface = interface or wanted.channel
        self.first_ns: int | None = None
        self.last_ns = 0
        self.path = path
        self._reader = reader
        self._wanted = wanted
        self._asked = interface
        self._taken = wanted.read | wanted.sent
        self._offset_ns = 0
        self._suspect: tuple[int, int, bytes, str] | None = None
        self._disordered = False

    @property
    def unread(self) -> Counter[str]:
        """Lines that were no frames, by reason."""
        return self._reader.unread

    def share(self) -> float:
        """How much of the file has been read, 0 to 1."""
        return self._reader.share()

    def frames(self) -> Iterator[Frames]:
        """The frames, a part at a time. Raises InputError for a log that holds nothing usable."""
        parts = self._reader.parts()
        peeked: list[Part] = []
        for part in parts:
            peeked.append(part)
            if sum(map(len, peeked)) >= _PEEK_ROWS:
                break
        self.interface = self._choose([row for part in peeked for row in part])
        carry: Frames = []
        for part in peeked:
            carry += self._selected(part)
        peeked.clear()
        while True:
            out, carry = self._released(carry)
            if out:
                yield out
            following = next(parts, None)
            if following is None:
                break
            carry += self._selected(following)
        if self._suspect is not None:
            suspect, self._suspect = self._suspect, None
            self._take(suspect, max(self.last_ns, suspect[0] + self._offset_ns), carry)
        carry.sort(key=_time)
        if carry:
            self._count(carry)
            yield carry
        self.notes[:0] = self._reader.notes
        if not self.counts.used:
            raise self._nothing_usable()

    def _choose(self, rows: Part) -> str:
        """The interface of the log that is the controller's."""
        buses = Counter(row[3] for row in rows)
        if self._asked is not None:
            if rows and self._asked not in buses:
                mend = f"it has {', '.join(sorted(buses))}"
                raise InputError.at(self.path, f"begins without frames of interface {self._asked}", mend)
            return self._asked
        if self._wanted.channel in buses or not buses:
            return self._wanted.channel
        known = Counter(row[3] for row in rows if row[1] in self._wanted.read)
        fitting = list(known) if len(buses) > 1 else list(buses)
        if len(fitting) == 1:
            why = "its only one" if len(buses) == 1 else "the only one with frames that the controller reads"
            self.notes.append(f"the log has no interface {self._wanted.channel}; {fitting[0]} taken, {why}")
            return fitting[0]
        what = f"has no interface {self._wanted.channel}, but {', '.join(sorted(buses))}"
        raise InputError.at(self.path, what, "choose with --interface")

    def _selected(self, part: Part) -> Frames:
        """The rows of the chosen interface that matter, their stamps on a clock that does not go back."""
        frames: Frames = []
        counts, chosen, taken, add = self.counts, self.interface, self._taken, frames.append
        counts.frames += len(part)
        if self.first_ns is None:
            for row in part:
                if row[3] == chosen:
                    self.first_ns = self.last_ns = row[0]
                    break
        last_ns, offset_ns = self.last_ns, self._offset_ns
        suspicious = self._suspect is not None
        for row in part:
            time_ns, can_id, data, bus = row
            if bus != chosen:
                counts.other_interfaces += 1
                continue
            time_ns += offset_ns
            if suspicious or not 0 <= time_ns - last_ns <= GAP_MAX_NS:
                self.last_ns = last_ns
                self._out_of_step(row, frames)
                last_ns, offset_ns = self.last_ns, self._offset_ns
                suspicious = self._suspect is not None
                continue
            last_ns = time_ns
            if can_id in taken:
                add((time_ns, can_id, data))
            else:
                self._stray(time_ns, can_id, data, frames)
        self.last_ns = last_ns
        return frames

    def _take(self, row: tuple[int, int, bytes, str], time_ns: int, frames: Frames) -> None:
        self.last_ns = max(self.last_ns, time_ns)
        if row[1] in self._taken:
            frames.append((time_ns, row[1], row[2]))
        else:
            self._stray(time_ns, row[1], row[2], frames)

    def _out_of_step(self, row: tuple[int, int, bytes, str], frames: Frames) -> None:
        """A row whose stamp does not follow the last one, or that follows such a row."""
        suspect, self._suspect = self._suspect, None
        time_ns, last_ns = row[0] + self._offset_ns, self.last_ns
        fits = -ORDER_WINDOW_NS <= time_ns - last_ns <= GAP_MAX_NS
        if suspect is not None:
            if fits:  # one stamp alone was wrong
                self.counts.wrong_stamps += 1
                self._take(suspect, last_ns, frames)
            else:
                self._step_clock(suspect)
                self._take(suspect, suspect[0] + self._offset_ns, frames)
                self._again(row, frames)
                return
        if fits:
            if time_ns < self.last_ns:
                self.counts.sorted += 1
                self._disordered = True
            self._take(row, time_ns, frames)
        else:
            self._suspect = row

    def _again(self, row: tuple[int, int, bytes, str], frames: Frames) -> None:
        """The row after a step of the clock, on the new clock."""
        if -ORDER_WINDOW_NS <= row[0] + self._offset_ns - self.last_ns <= GAP_MAX_NS:
            self._disordered = True
            self._take(row, row[0] + self._offset_ns, frames)
        else:
            self._suspect = row

    def _step_clock(self, row: tuple[int, int, bytes, str]) -> None:
        """From this row on, time goes on from the last frame."""
        ahead_ns = row[0] + self._offset_ns - self.last_ns
        if ahead_ns < 0:
            self.counts.steps_back += 1
            self._offset_ns -= ahead_ns
            self.notes.append(
                f"the log's clock goes back by {-ahead_ns / 1e9:.6g} s; time goes on from there"
            )
        else:
            cut_ns = ahead_ns - GAP_MAX_NS
            self.counts.gaps_cut += 1
            self.counts.cut_s += cut_ns / 1e9
            self._offset_ns -= cut_ns
            self.notes.append(
                f"of a gap of {ahead_ns / 1e9:.6g} s, {GAP_MAX_NS / 1e9:g} s were lived through"
            )
        del self.notes[20:]

    def _stray(self, time_ns: int, can_id: int, data: bytes, frames: Frames) -> None:
        """A frame that is none of the controller's, or not a plain one."""
        counts, read = self.counts, self._wanted.read
        if can_id & ERROR_FLAG:
            counts.bus_off += bool(can_id & linux.ERR_BUS_OFF)
            if can_id & _ERRORS_TOLD:
                frames.append((time_ns, can_id, data))
            else:
                counts.rejected["error_frame"] += 1
        elif can_id & REMOTE_FLAG:
            if can_id & _PLAIN_ID in read:
                frames.append((time_ns, can_id & ~FD_FLAG, b""))
            else:
                counts.rejected["remote_frame"] += 1
        elif can_id & FD_FLAG and can_id & _PLAIN_ID in self._taken:
            frames.append((time_ns, can_id & _PLAIN_ID if self._wanted.fd else can_id, data))
        else:
            counts.foreign += 1

    def _released(self, frames: Frames) -> tuple[Frames, Frames]:
        """What can go, and what has to wait for frames that may have to stand before it."""
        if self._disordered:
            frames.sort(key=_time)
            self._disordered = False
        at = bisect_right(frames, self.last_ns - ORDER_WINDOW_NS, key=_time)
        out, rest = frames[:at], frames[at:]
        self._count(out)
        return out, rest

    def _count(self, frames: Frames) -> None:
        for can_id, count in Counter(map(itemgetter(1), frames)).items():
            if can_id in self._wanted.read:
                self.counts.used += count
            elif can_id in self._wanted.sent:
                self.counts.own += count

    def _nothing_usable(self) -> InputError:
        counts, lines = self.counts, sum(self.unread.values())
        if counts.frames:
            what = f"holds no frame that the controller reads, among {counts.frames} frames"
            return InputError.at(self.path, what, "is it the right log, DBC and --interface?")
        what = f"holds no CAN frames with time stamps{f', but {lines} other lines' if lines else ''}"
        return InputError.at(
            self.path, what, "is it a log of candump -L (or -ta, -td), ASC, BLF, TRC or MF4?"
        )


_time = itemgetter(0)
