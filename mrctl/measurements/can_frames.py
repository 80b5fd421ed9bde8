"""Frames out of a CAN log: candump's text, and ASC, BLF, TRC through python-can.

candump is read here, line by line: python-can turns its error frames (`20000040#...`) into data frames with
the ID 0x40.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mrctl.can.quiet_import import can
from mrctl.can.specs import ERROR_FLAG, EXTENDED_FLAG
from mrctl.errors import InputError
from mrctl.measurements.external import damage_is_input_error, warnings_of
from mrctl.measurements.run import FloatArray

_LINE = re.compile(
    r"\((?P<time>\d+(?:\.\d+)?)\)\s+(?P<bus>\S+)\s+(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#"
    r"(?:(?P<remote>R[0-9A-Fa-f]?)|(?:#[0-9A-Fa-f])?(?P<data>(?:[0-9A-Fa-f]{2}\.?)*)(?:_[0-9A-Fa-f])?)"
    r"(?:\s+[RT])?\s*"
)
_READERS = {".asc": "ASCReader", ".blf": "BLFReader", ".trc": "TRCReader"}


@dataclass(slots=True)
class Frames:
    """The payloads of some identifiers: id (bit 31 set for extended ones) to times and payloads."""

    times: dict[int, list[float]] = field(default_factory=dict)
    payloads: dict[int, list[bytes]] = field(default_factory=dict)
    total: int = 0
    skipped: dict[str, int] = field(default_factory=dict)
    buses: set[str] = field(default_factory=set)

    def add(self, identifier: int, time: float, payload: bytes) -> None:
        """Keep one frame."""
        self.times.setdefault(identifier, []).append(time)
        self.payloads.setdefault(identifier, []).append(payload)

    def skip(self, reason: str) -> None:
        """Count a frame or line that is left out."""
        self.skipped[reason] = self.skipped.get(reason, 0) + 1

    def of(self, identifier: int) -> tuple[FloatArray, list[bytes]]:
        """Times (n,) and payloads of one identifier."""
        return np.array(self.times.get(identifier, []), dtype=np.float64), self.payloads.get(identifier, [])


def read_frames(path: Path, data: bytes, wanted: Collection[int], bus: str | None) -> Frames:
    """The frames in a log whose identifier is wanted, from one bus or all. InputError for what is no log."""
    reader = _READERS.get(path.suffix.lower())
    frames = Frames()
    messages = _candump(path, data, frames) if reader is None else _python_can(path, reader, frames)
    for identifier, time, channel, payload in messages:
        frames.total += 1
        frames.buses.add(channel)
        if (bus is None or channel == bus) and identifier in wanted:
            frames.add(identifier, time, payload)
    if not frames.total:
        raise InputError.at(path, "holds no CAN data frames", "is it a log of candump -l, ASC, BLF or TRC?")
    if bus is not None and bus not in frames.buses:
        there = ", ".join(sorted(frames.buses))
        raise InputError.at(path, f"has no frames of bus {bus}", f"it has {there}: correct `bus` in the map")
    return frames


def _candump(path: Path, data: bytes, frames: Frames) -> Iterator[tuple[int, float, str, bytes]]:
    """The data frames of `candump -l`; InputError at a broken line, unless it is the last, cut off."""
    lines = data.decode("ascii", errors="replace").splitlines()
    for number, line in enumerate(lines, 1):
        match = _LINE.fullmatch(line)
        if match is None:
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            if number == len(lines) and frames.total:
                frames.skip("a last line that is cut off")
                continue
            raise InputError.at(path, "is no line of candump -l", "repair or remove the line", number)
        identifier = int(match["id"], 16)
        if len(match["id"]) == 8:
            if identifier & ERROR_FLAG:
                frames.skip("error frames")
                continue
            identifier |= EXTENDED_FLAG
        if match["remote"]:
            frames.skip("remote frames")
            continue
        yield identifier, float(match["time"]), match["bus"], bytes.fromhex(match["data"].replace(".", ""))


def _python_can(path: Path, reader: str, frames: Frames) -> Iterator[tuple[int, float, str, bytes]]:
    """The data frames that a reader of python-can finds."""
    kind = reader.removesuffix("Reader")
    own = (can.exceptions.CanError, can.io.blf.BLFParseError)
    with warnings_of("can") as doubts, damage_is_input_error(path, kind, *own):
        with getattr(can, reader)(str(path)) as messages:
            for message in messages:
                if message.is_error_frame:
                    frames.skip("error frames")
                elif message.is_remote_frame:
                    frames.skip("remote frames")
                else:
                    identifier = message.arbitration_id | (EXTENDED_FLAG if message.is_extended_id else 0)
                    yield identifier, float(message.timestamp), str(message.channel), bytes(message.data)
        if doubts.count:
            frames.skipped["lines that could not be understood"] = doubts.count
