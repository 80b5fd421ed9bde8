"""ASC, BLF and TRC through python-can, MF4 through asammdf: rows a part at a time."""

from __future__ import annotations

import heapq
import itertools
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from mrctl.can.quiet_import import can
from mrctl.can.specs import ERROR_FLAG, EXTENDED_FLAG, FD_FLAG, REMOTE_FLAG
from mrctl.errors import InputError
from mrctl.measurements.external import DAMAGE, damage_is_input_error, library, warnings_of
from mrctl.replay.candump import unreadable
from mrctl.replay.rows import NANOSECONDS, ROWS_PER_PART, Part

PYTHON_CAN_READERS = {".asc": "ASCReader", ".blf": "BLFReader", ".trc": "TRCReader"}
MDF_SUFFIXES = (".mf4", ".mdf")

# Of one group of an MF4 that is in memory at once.
_RECORDS_AT_ONCE = 20_000

RowTuple = tuple[int, int, bytes, str]


class PythonCanReader:
    """Reads what python-can reads."""

    def __init__(self, path: Path) -> None:
        """Raises InputError where the file cannot be opened."""
        self.unread: Counter[str] = Counter()
        self.notes: list[str] = []
        self._path = path
        self._done = 0.0
        try:
            self._size = max(1, path.stat().st_size)
            with path.open("rb"):
                pass
        except OSError as error:
            raise unreadable(path, error) from error

    def share(self) -> float:
        """How much of the file has been read, 0 to 1."""
        return self._done

    def parts(self) -> Iterator[Part]:
        """The rows, a part at a time; what follows damage is left out and counted."""
        name = PYTHON_CAN_READERS[self._path.suffix.lower()]
        kind, failures = name.removesuffix("Reader"), (*DAMAGE, can.CanError, can.io.blf.BLFParseError)
        given = False
        with warnings_of("can") as doubts:
            with damage_is_input_error(self._path, kind, can.CanError, can.io.blf.BLFParseError):
                reader: Any = getattr(can, name)(str(self._path))
            with closing_reader(reader):
                messages = iter(reader)
                while True:
                    part: Part = []
                    try:
                        part.extend(_row(message) for message in itertools.islice(messages, ROWS_PER_PART))
                    except failures as error:
                        if not given and not part:
                            with damage_is_input_error(self._path, kind, *failures):
                                raise
                        self.unread["damaged_rest"] += 1
                        self.notes.append(
                            f"what follows {len(part)} frames of the last part is damaged: {error}"
                        )
                        yield part
                        break
                    if not part:
                        break
                    given = True
                    self._done = _position(reader, self._size, self._done)
                    yield part
            self.unread["bad_line"] += doubts.count
        self._done = 1.0


class MdfReader:
    """Reads ASAM's bus logging in MF4: groups of channels named CAN_DataFrame.*, merged by time."""

    def __init__(self, path: Path) -> None:
        """Raises InputError without asammdf."""
        self.unread: Counter[str] = Counter()
        self.notes: list[str] = []
        self._path = path
        self._done = self._total = 0
        self._asammdf = library("asammdf", path, "MF4")

    def share(self) -> float:
        """How much of the file has been read, 0 to 1."""
        return self._done / max(1, self._total)

    def parts(self) -> Iterator[Part]:
        """The rows, a part at a time."""
        path, broken = self._path, self._asammdf.blocks.utils.MdfException
        if not path.exists():
            raise InputError.at(path, "cannot be read (No such file or directory)", "give a readable log")
        with damage_is_input_error(path, "MF4", broken), self._asammdf.MDF(str(path)) as file:
            begin_ns = round(file.header.start_time.timestamp() * NANOSECONDS)
            streams = []
            for kind, flag in (("Data", 0), ("Remote", REMOTE_FLAG), ("Error", ERROR_FLAG)):
                places = file.channels_db.get(f"CAN_{kind}Frame", ())
                for group in sorted({place[0] for place in places}):
                    count = file.groups[group].channel_group.cycles_nr
                    self._total += count
                    streams.append(self._rows(file, group, f"CAN_{kind}Frame", flag, count, begin_ns))
            merged = heapq.merge(*streams, key=lambda row: row[0])
            while part := list(itertools.islice(merged, ROWS_PER_PART)):
                self._done += len(part)
                yield part

    @staticmethod
    def _rows(
        file: Any,  # noqa: ANN401  # asammdf is untyped
        group: int,
        kind: str,
        flag: int,
        count: int,
        begin_ns: int,
    ) -> Iterator[RowTuple]:
        names = {ch.name for ch in file.groups[group].channels}
        for offset in range(0, count, _RECORDS_AT_ONCE):
            more = {"record_offset": offset, "record_count": min(_RECORDS_AT_ONCE, count - offset)}

            def cells(name: str, default: int, more: dict[str, int] = more) -> list[Any]:
                full = f"{kind}.{name}"
                if full not in names:
                    return [default] * more["record_count"]
                return list(file.get(full, group=group, raw=True, **more).samples)

            stamps = file.get(kind, group=group, raw=True, **more).timestamps.tolist()
            payloads = cells("DataBytes", 0) if f"{kind}.DataBytes" in names else [b""] * len(stamps)
            columns = [
                cells(*pair)
                for pair in (("ID", 0), ("IDE", 0), ("BusChannel", 0), ("DataLength", 64), ("EDL", 0))
            ]
            for stamp, payload, can_id, extended, bus, length, fd in zip(
                stamps, payloads, *columns, strict=True
            ):
                flags = (EXTENDED_FLAG if extended else 0) | flag | (FD_FLAG if fd else 0)
                data = b"" if flag == REMOTE_FLAG else bytes(payload)[: int(length)]
                # Stamps are floats: to the microsecond they are exact.
                yield (
                    begin_ns + round(stamp * 1e6) * 1000,
                    int(can_id) & 0x1FFFFFFF | flags,
                    data,
                    str(int(bus)),
                )


def closing_reader(reader: Any) -> Any:  # noqa: ANN401  # python-can's readers
    """The reader as a context that is stopped at its end."""

    class _Stop:
        def close(self) -> None:
            reader.stop()

    return closing(_Stop())


def _row(message: Any) -> RowTuple:  # noqa: ANN401  # python-can's Message
    can_id = message.arbitration_id | (EXTENDED_FLAG if message.is_extended_id else 0)
    if message.is_error_frame:
        can_id = message.arbitration_id & 0x1FFFFFFF | ERROR_FLAG
    elif message.is_remote_frame:
        can_id |= REMOTE_FLAG
    elif message.is_fd:
        can_id |= FD_FLAG
    data = b"" if message.is_remote_frame else bytes(message.data)
    # Stamps are floats: to the microsecond they are exact.
    return round(message.timestamp * 1e6) * 1000, can_id, data, str(message.channel)


def _position(reader: Any, size: int, before: float) -> float:  # noqa: ANN401  # python-can's readers
    try:
        return min(1.0, max(before, float(reader.file.tell()) / size))
    except (OSError, ValueError, AttributeError):
        return before
