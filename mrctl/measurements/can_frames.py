"""Frames out of a CAN log: candump's text, ASC, BLF and TRC through python-can, MF4 through asammdf.

candump is read here, line by line: python-can turns its error frames (`20000040#...`) into data frames with
the ID 0x40.
"""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mrctl.can.quiet_import import can
from mrctl.can.specs import ERROR_FLAG, EXTENDED_FLAG
from mrctl.errors import InputError
from mrctl.measurements.external import damage_is_input_error, library, warnings_of
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

    def skip(self, reason: str, count: int = 1) -> None:
        """Count frames or lines that are left out."""
        if count:
            self.skipped[reason] = self.skipped.get(reason, 0) + count

    def of(self, identifier: int) -> tuple[FloatArray, list[bytes]]:
        """Times (n,) and payloads of one identifier."""
        return np.array(self.times.get(identifier, []), dtype=np.float64), self.payloads.get(identifier, [])


def read_frames(path: Path, data: bytes, wanted: Collection[int], bus: str | None) -> Frames:
    """The frames in a log whose identifier is wanted, from one bus or all. InputError for what is no log."""
    suffix, frames = path.suffix.lower(), Frames()
    if suffix in _READERS:
        messages = _python_can(path, _READERS[suffix], frames)
    elif suffix in {".mf4", ".mdf"}:
        messages = _mf4(path, data, frames)
    else:
        messages = _candump(path, data, frames)
    for identifier, time, channel, payload in messages:
        frames.total += 1
        frames.buses.add(channel)
        if (bus is None or channel == bus) and identifier in wanted:
            frames.add(identifier, time, payload)
    if not frames.total:
        raise InputError.at(
            path, "holds no CAN data frames", "is it a log of candump -l, ASC, BLF, TRC or MF4?"
        )
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
        frames.skip("lines that could not be understood", doubts.count)


def _mf4(path: Path, data: bytes, frames: Frames) -> Iterator[tuple[int, float, str, bytes]]:
    """The data frames of ASAM's bus logging: groups of channels named CAN_DataFrame.*."""
    asammdf = library("asammdf", path, "MDF")
    broken = asammdf.blocks.utils.MdfException
    with damage_is_input_error(path, "MDF", broken), asammdf.MDF(io.BytesIO(data)) as file:
        for kind in ("error", "remote"):
            for place in file.channels_db.get(f"CAN_{kind.capitalize()}Frame", ()):
                count = len(file.get(group=place[0], index=place[1]).timestamps)
                frames.skip(f"{kind} frames", count)
        for group, index in file.channels_db.get("CAN_DataFrame.DataBytes", ()):
            payloads = file.get(group=group, index=index, raw=True)
            stamps = payloads.timestamps.tolist()
            columns = [
                _cells(file, group, f"CAN_DataFrame.{name}", default, len(stamps))
                for name, default in (("ID", 0), ("IDE", 0), ("BusChannel", 0), ("DataLength", 64))
            ]
            for stamp, payload, *cells in zip(stamps, payloads.samples, *columns, strict=True):
                identifier, extended, bus, length = cells
                identifier |= EXTENDED_FLAG if extended else 0
                yield identifier, stamp, str(bus), bytes(payload)[:length]


def _cells(file: Any, group: int, name: str, default: int, count: int) -> list[int]:  # noqa: ANN401 - asammdf is untyped
    """A channel of whole numbers in one group, or `default` throughout where the group has none such."""
    places = [place for place in file.channels_db.get(name, ()) if place[0] == group]
    if not places:
        return [default] * count
    return [int(value) for value in file.get(group=group, index=places[0][1], raw=True).samples]
