"""candump's text, read a line at a time: the log form (`candump -L`, `-l`) and what it prints on a console.

    (1436509052.249713) vcan0 110#2A366C2BBA000000                      log form
     (000.002013)  vcan0  110   [8]  2A 36 6C 2B BA 00 00 00             console form, here with -t d

Stamps may be absolute (`-t a`), dates (`-t A`), from the first frame on (`-t z`) or from frame to frame
(`-t d`). Absolute stamps and those from zero rise all the time; stamps from frame to frame fall as much as
they rise, and that is how they are told apart.

python-can's reader turns an error frame (`20000040#...`) into a data frame with the ID 0x40, reads no console
form, and ends at the first bad line.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Final

from mrctl.can.specs import ERROR_FLAG, EXTENDED_FLAG, FD_FLAG, REMOTE_FLAG
from mrctl.errors import InputError
from mrctl.replay.gunzip import Gunzip
from mrctl.replay.rows import NANOSECONDS, Part

BYTES_PER_PART: Final = 1 << 17
STAMP_FORMS: Final = ("auto", "absolute", "delta")

# Stamps below it are no dates: 11 days after 1970.
_ABSOLUTE_FROM_NS: Final = 1_000_000 * NANOSECONDS
# Stamps that are looked at to tell which kind they are, and the fall against the rise that tells it.
_STAMPS_LOOKED_AT: Final = 500
_FALL_OF_DELTAS: Final = 0.5
_PLACES_KEPT: Final = 1 << 16

_LINE: Final = re.compile(
    r"\s*\((?P<time>[^)]*)\)\s+(?P<bus>\S+)\s+(?:[RT]X\s+(?:[-BE]\s+){2})?(?:"
    r"(?P<id>[0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})#(?P<fd>#[0-9A-Fa-f])?"
    r"(?:(?P<remote>[Rr][0-9A-Fa-f]?)|(?P<data>(?:[0-9A-Fa-f]{2}\.?)*))(?:_[0-9A-Fa-f])?(?:\s+[RT])?|"
    r"(?P<cid>[0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})\s+\[(?P<length>\d{1,2})\](?:"
    r"\s+(?P<cremote>remote request)|(?P<cdata>(?:\s+[0-9A-Fa-f]{2})*))(?:\s+(?:'.*'?|ERRORFRAME))?"
    r")\s*"
)
_SECONDS: Final = re.compile(r"(\d{1,12})(?:\.(\d{1,9}))?")


class CandumpReader:
    """Reads candump's text; `.gz` too."""

    def __init__(self, path: Path, stamps: str = "auto") -> None:
        """stamps: one of STAMP_FORMS. Raises InputError where the file cannot be opened."""
        self.unread: Counter[str] = Counter()
        self.notes: list[str] = []
        self._path = path
        self._stamps = stamps
        self._line_number = 0
        self._known: dict[str, tuple[int, str]] = {}  # `vcan0 110`, as it stands in data frames
        try:
            self._raw = path.open("rb")
            self._size = max(1, path.stat().st_size)
        except OSError as error:
            raise unreadable(path, error) from error

    def share(self) -> float:
        """How much of the file has been read, 0 to 1."""
        return 1.0 if self._raw.closed else min(1.0, self._raw.tell() / self._size)

    def parts(self) -> Iterator[Part]:
        """The rows, a part at a time."""
        with self._raw:
            unpacked = Gunzip(self._raw) if self._path.suffix == ".gz" else None
            binary = self._raw if unpacked is None else io.BufferedReader(unpacked)
            try:
                with io.TextIOWrapper(binary, encoding="latin-1", newline="\n") as text:
                    yield from self._in_time(self._parts(text))
            except OSError as error:
                if not self._line_number:
                    raise unreadable(self._path, error) from error
                self.unread["truncated_file"] += 1
            if unpacked is not None and unpacked.damaged:
                self.unread["truncated_file"] += 1

    def _parts(self, text: io.TextIOWrapper) -> Iterator[Part]:
        lines = text.readlines(BYTES_PER_PART)
        while lines:
            following = text.readlines(BYTES_PER_PART)
            part = self._rows(lines)
            if not following and part and not lines[-1].endswith("\n"):
                self._judge_last(part, lines[-1])
            yield part
            lines = following

    def _rows(self, lines: Sequence[str]) -> Part:
        """The rows of these lines; the hot path takes what `candump -L` writes of data frames."""
        part: Part = []
        add, known, from_hex = part.append, self._known, bytes.fromhex
        for line in lines:
            try:
                place, _, payload = line[20:].partition("#")
                can_id, bus = known[place]
                if line[11] == ".":  # ten figures before it, six behind: any stamp since 2001
                    add((int(line[1:11] + line[12:18]) * 1000, can_id, from_hex(payload), bus))
                    continue
            except (ValueError, KeyError, IndexError):
                pass
            self._slow(line, part, lines)
        self._line_number += len(lines)
        return part

    def _slow(self, line: str, part: Part, lines: Sequence[str]) -> None:
        """A line of any form, or one that is none."""
        match = _LINE.fullmatch(line)
        row = None if match is None else self._row(match)
        if row is not None:
            part.append(row)
        elif line.strip() and not line.lstrip().startswith("#"):
            if not line.endswith("\n"):
                self.unread["truncated_line"] += 1
                return
            self.unread["bad_line"] += 1
            if self.unread["bad_line"] == 1:
                number = self._line_number + 1 + lines.index(line)
                self.notes.append(
                    f"the first line that is none of candump's is {number}: {line.strip()[:60]!r}"
                )

    def _row(self, match: re.Match[str]) -> tuple[int, int, bytes, str] | None:
        time_ns = stamp_ns(match["time"])
        text, console = match["id"], False
        if text is None:
            text, console = match["cid"], True
        can_id = int(text, 16)
        if time_ns is None or (len(text) == 3 and can_id > 0x7FF):
            return None
        flags = 0
        if len(text) == 8:
            flags = 0 if can_id & ERROR_FLAG else EXTENDED_FLAG
            if can_id >> 30 or (not flags and can_id & 0x1FFFFFFF >= 1 << 29):
                return None
        if console:
            data = bytes.fromhex((match["cdata"] or "").replace(" ", ""))
            remote, fd = match["cremote"] is not None, len(match["length"]) == 2
            if not remote and len(data) != int(match["length"]):
                return None
        else:
            data = bytes.fromhex((match["data"] or "").replace(".", ""))
            remote, fd = match["remote"] is not None, match["fd"] is not None
            if not (remote or fd or flags & ERROR_FLAG or can_id & ERROR_FLAG):
                if len(self._known) >= _PLACES_KEPT:
                    self._known.clear()
                self._known[f"{match['bus']} {text}"] = can_id | flags, match["bus"]
        if len(data) > (64 if fd else 8):
            return None
        return (
            time_ns,
            can_id | flags | (REMOTE_FLAG if remote else 0) | (FD_FLAG if fd else 0),
            data,
            match["bus"],
        )

    def _judge_last(self, part: Part, line: str) -> None:
        """A last line without an end that gave a shorter payload than its identifier has was cut off."""
        if not line.strip():
            return
        _, can_id, data, bus = part[-1]
        if any(row[1] == can_id and row[3] == bus and len(row[2]) > len(data) for row in part[-1000:-1]):
            part.pop()
            self.unread["truncated_line"] += 1

    def _in_time(self, parts: Iterator[Part]) -> Iterator[Part]:
        """The parts with stamps that count from one moment, whatever they counted from in the file."""
        seen: Part = []
        held: list[Part] = []
        for part in parts:
            held.append(part)
            seen += part[:_STAMPS_LOOKED_AT]
            if len(seen) >= _STAMPS_LOOKED_AT:
                break
        deltas = self._stamps == "delta" or (self._stamps == "auto" and are_deltas([row[0] for row in seen]))
        if not deltas:
            yield from held
            yield from parts
            return
        self.notes.append("time stamps taken as from frame to frame (candump -t d)")
        summed = _Summed()
        yield from map(summed, held)
        yield from map(summed, parts)


class _Summed:
    """Adds stamps up from frame to frame."""

    def __init__(self) -> None:
        self._now_ns = 0

    def __call__(self, part: Part) -> Part:
        now_ns, out = self._now_ns, []
        for step_ns, can_id, data, bus in part:
            now_ns += step_ns
            out.append((now_ns, can_id, data, bus))
        self._now_ns = now_ns
        return out


def are_deltas(stamps_ns: Sequence[int]) -> bool:
    """Whether stamps count from frame to frame: they fall about as much as they rise, or never change."""
    steps = [later - earlier for earlier, later in pairwise(stamps_ns)]
    if len(steps) < 3 or max(stamps_ns) >= _ABSOLUTE_FROM_NS:
        return False
    risen, fallen = sum(step for step in steps if step > 0), -sum(step for step in steps if step < 0)
    if risen == 0:
        return max(stamps_ns) > 0
    # The first stamp is 0 and the next ones about the cycle time: that rise has no fall.
    level = sum(step == 0 for step in steps) > len(steps) // 2
    return fallen > _FALL_OF_DELTAS * (risen - max(steps[0], 0)) or level


def stamp_ns(text: str) -> int | None:
    """A stamp between candump's brackets in ns, or None."""
    match = _SECONDS.fullmatch(text.strip())
    if match is not None:
        return int(match[1]) * NANOSECONDS + int((match[2] or "0").ljust(9, "0"))
    date, _, fraction = text.strip().partition(".")
    try:
        whole = int(datetime.fromisoformat(date).timestamp())
    except (ValueError, OverflowError, OSError):
        return None
    return (
        whole * NANOSECONDS + int(fraction.ljust(9, "0"))
        if fraction.isdigit() and len(fraction) < 10
        else None
    )


def unreadable(path: Path, error: Exception) -> InputError:
    """The error for a file that cannot be opened or read."""
    why = getattr(error, "strerror", None) or str(error)
    return InputError.at(path, f"cannot be read ({why})", "give a readable log")
