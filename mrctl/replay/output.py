"""The frames of a replay as `candump -L` writes them: aside first, renamed when whole."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from mrctl.can.specs import EXTENDED_FLAG
from mrctl.errors import InputError
from mrctl.replay.source import LogSource
from mrctl.runtime.tick import Frame
from mrctl.whole_file import whole_file


class CandumpWriter:
    """A context; called with time and frames. An error leaves nothing behind."""

    def __init__(self, path: Path, source: LogSource) -> None:
        """source: its interface names the frames'. Raises InputError where the file cannot be written."""
        self._path = path
        self._source = source
        self._names: dict[int, str] = {}
        self._whole = whole_file(path, encoding="ascii", errors="replace", newline="\n")
        try:
            self._write = self._whole.__enter__().write
        except OSError as error:
            raise self._unwritable(error) from error

    def __call__(self, time_ns: int, frames: Sequence[Frame]) -> None:
        """Write the frames that left at this time."""
        seconds, rest = divmod(time_ns // 1000, 1_000_000)
        names = self._names
        for can_id, data in frames:
            name = names.get(can_id)
            if name is None:
                names[can_id] = name = self._name(can_id)
            try:
                self._write(f"({seconds:010d}.{rest:06d}) {name}#{data.hex().upper()}\n")
            except OSError as error:
                raise self._unwritable(error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._whole.__exit__(kind, error, trace)
        except OSError as failure:
            raise self._unwritable(failure) from failure

    def _name(self, can_id: int) -> str:
        interface = self._source.interface
        interface = f"can{interface}" if interface.isdigit() else interface
        plain = can_id & 0x1FFFFFFF
        return f"{interface} {plain:08X}" if can_id & EXTENDED_FLAG else f"{interface} {plain:03X}"

    def _unwritable(self, error: OSError) -> InputError:
        return InputError.at(self._path, f"cannot be written ({error.strerror})", "choose another place")
