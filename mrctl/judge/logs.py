"""Frames of a log or a bus, as (time in s, identifier, payload, interface).

candump's text is read here: python-can's reader takes an error frame for a data frame and ends at a bad line.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mrctl.judge.frames import EXTENDED, UnusableError

REMOTE, ERROR, FD = 1 << 30, 1 << 29, 1 << 32
Seen = tuple[float, int, bytes, str]

_LOG = re.compile(
    r"\s*\((\d+(?:\.\d+)?)\)\s+(\S+)\s+([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(#[0-9A-Fa-f])?"
    r"(?:([Rr])[0-9A-Fa-f]?|((?:[0-9A-Fa-f]{2})*))(?:\s+[RT])?\s*"
)
_CONSOLE = re.compile(
    r"\s*\((\d+(?:\.\d+)?)\)\s+(\S+)\s+(?:[RT]X\s+\S\s+\S\s+)?([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})\s+\[(\d+)\]"
    r"(?:\s+(remote request)|((?:\s+[0-9A-Fa-f]{2})*))(?:\s+(?:'.*|ERRORFRAME))?\s*"
)


def frames_of_log(path: Path) -> Iterator[Seen]:
    """The frames of a log; lines of candump that are none are passed over. Raises UnusableError."""
    if path.suffix.lower() in {".asc", ".blf", ".trc", ".mf4"}:
        yield from _python_can(path)
        return
    try:
        with path.open(encoding="latin-1") as lines:
            for line in lines:
                seen = _candump(line)
                if seen is not None:
                    yield seen
    except OSError as error:
        raise UnusableError(f"{path}: cannot be read ({error.strerror}); give a readable log") from error


def frames_of_bus(interface: str, channel: str, duration_s: float | None) -> Iterator[Seen | None]:
    """The frames of a bus as they come, None where none does for a while. Raises UnusableError."""
    import can  # noqa: PLC0415  # it takes a second: not for logs of candump

    try:
        bus = can.Bus(interface=interface, channel=channel, fd=False, ignore_config=True)
    except (OSError, can.CanError, ValueError, ImportError) as error:
        why = " ".join(str(error).split())
        raise UnusableError(f"CAN interface {channel} cannot be opened: {why}; is it up?") from error
    ends = None if duration_s is None else time.monotonic() + duration_s
    with bus:
        while ends is None or time.monotonic() < ends:
            try:
                message = bus.recv(timeout=0.01)
            except (OSError, can.CanError):  # the interface went down: nothing comes until it is up
                time.sleep(0.01)
                message = None
            yield None if message is None else _seen(message)


def _candump(line: str) -> Seen | None:
    match = _LOG.fullmatch(line)
    fd: str | None
    if match is not None:
        stamp, interface, name, fd, remote, text = match.groups()
    else:
        match = _CONSOLE.fullmatch(line)
        if match is None:
            return None
        stamp, interface, name, length, remote, text = match.groups()
        fd = "#" if len(length) == 2 else None
    identifier = int(name, 16)
    if len(name) == 8 and not identifier & ERROR:
        identifier |= EXTENDED
    identifier |= (REMOTE if remote else 0) | (FD if fd else 0)
    return float(stamp), identifier, bytes.fromhex((text or "").replace(" ", "")), interface


def _python_can(path: Path) -> Iterator[Seen]:
    import can  # noqa: PLC0415  # as above

    try:
        with can.LogReader(str(path)) as messages:
            for message in messages:
                yield _seen(message)
    except (
        OSError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        NotImplementedError,
        can.CanError,
    ) as error:
        why = " ".join(str(error).split())
        raise UnusableError(f"{path}: cannot be read ({why}); is it damaged? export it again") from error


def _seen(message: Any) -> Seen:  # noqa: ANN401  # python-can's Message
    identifier = message.arbitration_id | (EXTENDED if message.is_extended_id else 0)
    if message.is_error_frame:
        identifier = message.arbitration_id & 0x1FFFFFFF | ERROR
    identifier |= (REMOTE if message.is_remote_frame else 0) | (FD if message.is_fd else 0)
    return float(message.timestamp), identifier, bytes(message.data or b""), str(message.channel)
