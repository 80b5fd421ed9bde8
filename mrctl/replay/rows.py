"""What readers of logs give: rows, a part of the log at a time, and counts of what was no row."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Final, NamedTuple, Protocol, TypeAlias

ROWS_PER_PART: Final = 2000

NANOSECONDS: Final = 1_000_000_000


class Row(NamedTuple):
    """A frame in a log. Readers may give plain tuples of the same order: they are cheaper."""

    time_ns: int
    can_id: int
    """Linux' canid_t: bit 31 extended, bit 30 remote frame, bit 29 error frame; bit 32 a CAN FD frame."""
    data: bytes
    bus: str


Part: TypeAlias = list[tuple[int, int, bytes, str]]


class LogReader(Protocol):
    """Reads one log, once, in the order of the file."""

    unread: Counter[str]
    """Lines and pieces that gave no row, by reason."""

    notes: list[str]
    """Sentences about the log for a person: how its stamps were taken, its first bad line."""

    def parts(self) -> Iterator[Part]:
        """The rows, a part at a time. Raises InputError where the file cannot be read at all."""

    def share(self) -> float:
        """How much of the file has been read, 0 to 1."""
