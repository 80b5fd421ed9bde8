"""Reads `candump -L` logs and judges them with the DBC, cantools and autosar-e2e: nothing of mrctl."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cantools
import cantools.database
from e2e.p02 import e2e_p02_check

CHECKOUT = Path(__file__).resolve().parent.parent.parent
LINE = re.compile(r"\((\d+\.\d+)\) (\S+) ([0-9A-F]{3}|[0-9A-F]{8})#(R\d?|#[0-9A-F]|)([0-9A-F]*)")


@dataclass(frozen=True)
class Frame:
    """One line of a log. `data` is None for a remote frame."""

    time_s: float
    can_id: int
    extended: bool
    data: bytes | None
    fd: bool = False


def read(text: str) -> list[Frame]:
    """All frames of a `candump -L` log; any other line is an error in the test."""
    frames = []
    for number, line in enumerate(text.splitlines(), 1):
        found = LINE.fullmatch(line.strip())
        assert found, f"line {number} of the log is no candump line: {line!r}"
        time_s, _, can_id, kind, data = found.groups()
        payload = None if kind.startswith("R") else bytes.fromhex(data)
        frames.append(Frame(float(time_s), int(can_id, 16), len(can_id) == 8, payload, kind.startswith("#")))
    return frames


def marks(text: str) -> dict[str, float]:
    """What `mark NAME` wrote: the time of each event, on the clock of the log."""
    return {name: float(time_s) for time_s, name in (line.split() for line in text.splitlines())}


@cache
def dbc() -> Any:
    """The project's DBC."""
    return cantools.database.load_file(str(CHECKOUT / "dbc" / "mrctl.dbc"))


def named(frames: Iterable[Frame], name: str) -> list[Frame]:
    """The frames with the ID of this message of the DBC."""
    can_id = dbc().get_message_by_name(name).frame_id
    return [frame for frame in frames if frame.can_id == can_id and not frame.extended and not frame.fd]


def decode(frame: Frame) -> dict[str, Any]:
    """All signals of a frame as the DBC scales them; choices by name."""
    assert frame.data is not None
    return dict(dbc().decode_message(frame.can_id, frame.data))


def e2e_is_right(frame: Frame) -> bool:
    """Whether CRC and data ID fit, by AUTOSAR's Profile 2 as the library autosar-e2e has it."""
    assert frame.data is not None
    ids = bytes.fromhex(dbc().get_message_by_frame_id(frame.can_id).dbc.attributes["E2EDataIDs"].value)
    return bool(e2e_p02_check(frame.data, ids, length=len(frame.data)))


def counters(frames: Iterable[Frame]) -> Iterator[int]:
    """The E2E counter of each frame."""
    return (frame.data[1] & 0xF for frame in frames if frame.data is not None)


def between(frames: Iterable[Frame], start_s: float, end_s: float) -> list[Frame]:
    """The frames of a stretch of time."""
    return [frame for frame in frames if start_s <= frame.time_s < end_s]


def line_pattern(name: str, **values: str | int) -> str:
    """A grep -E pattern for log lines of a message whose signals have these values; other nibbles are free.

    For scripts, which cannot afford a Python that imports cantools (5 s in the guest). A signal that shares a
    nibble with others not given is left free, so give all that do.
    """
    message = dbc().get_message_by_name(name)
    fixed = 0
    full = {signal.name: 0 for signal in message.signals} | values
    data = int.from_bytes(message.encode(full, scaling=True, strict=False), "little")
    for signal in message.signals:
        if signal.name in values:
            assert signal.byte_order == "little_endian"
            fixed |= ((1 << signal.length) - 1) << signal.start
    bits = 8 * message.length
    nibbles = [
        f"{data >> shift & 0xF:X}" if fixed >> shift & 0xF == 0xF else "."
        for byte in range(0, bits, 8)
        for shift in (byte + 4, byte)
    ]
    return f" {message.frame_id:03X}#{''.join(nibbles)}$"


def currents(frame: Frame) -> list[float]:
    """The four commanded currents of a CurrentCommand frame, A."""
    return [float(value) for name, value in decode(frame).items() if re.fullmatch(r"Cur_[FR][LR]", name)]


def states(frame: Frame) -> list[str]:
    """The state of each damper in a ControllerState frame."""
    return [str(value) for name, value in decode(frame).items() if name.startswith("State_")]
