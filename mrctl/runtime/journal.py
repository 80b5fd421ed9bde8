"""Log lines to systemd's journal as fields, over its own socket (systemd.journal-fields(7)).

Every key of a line becomes a field: `journalctl -u mrctl MRCTL_EVENT=state -o json` finds the changes of
state with MRCTL_AFTER, MRCTL_CAUSE and so on. MESSAGE is the line as a person reads it.
"""

from __future__ import annotations

import contextlib
import os
import re
import socket
from collections.abc import Iterator, Mapping
from typing import Any, Final

ADDRESS: Final = "/run/systemd/journal/socket"
_PRIORITY: Final = {"debug": 7, "info": 6, "warning": 4, "error": 3, "critical": 2}
_NOT_IN_A_NAME: Final = re.compile(r"[^A-Z0-9_]")


class Journal:
    """A datagram for each line; one that the journal does not take at once is dropped and counted."""

    def __init__(self, address: str = ADDRESS) -> None:
        """Raises OSError where there is no journal."""
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self._socket.setblocking(False)
        try:
            self._socket.connect(address)
        except OSError:
            self._socket.close()
            raise
        self.dropped = 0

    def write(self, event: Mapping[str, Any]) -> None:
        """Send a line: `event` and `level`, and what else it says."""
        try:
            self._socket.send(datagram(event))
        except OSError:  # full, or the journal restarts
            self.dropped += 1
        else:
            self.dropped = 0

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def is_stderr() -> bool:
    """Whether standard error goes to the journal: then it has set JOURNAL_STREAM to its device and inode."""
    named = os.environ.get("JOURNAL_STREAM", "")
    with contextlib.suppress(OSError):
        status = os.fstat(2)
        return named == f"{status.st_dev}:{status.st_ino}"
    return False


def datagram(event: Mapping[str, Any]) -> bytes:
    """A line in the journal's native format."""
    rest = {key: value for key, value in event.items() if key not in {"event", "level", "timestamp"}}
    words = [f"{key}={_text(value)}" for key, value in rest.items()]
    name = str(event.get("event", ""))
    fields = {
        "MESSAGE": f"{name}: {' '.join(words)}" if words else name,
        "PRIORITY": str(_PRIORITY.get(str(event.get("level")), 6)),
        "SYSLOG_IDENTIFIER": "mrctl",
        "MRCTL_EVENT": name,
        **{f"MRCTL_{_NOT_IN_A_NAME.sub('_', key.upper())}": value for key, value in _flat(rest)},
    }
    return b"".join(_field(key, value) for key, value in fields.items())


def _flat(values: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat({f"{key}_{inner}": item for inner, item in value.items()})
        else:
            yield key, _text(value)


def _text(value: Any) -> str:  # noqa: ANN401  # whatever a line says
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple | set | frozenset):
        return ",".join(_text(item) for item in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _field(key: str, value: str) -> bytes:
    data = value.encode(errors="replace")
    if b"\n" in data:
        return key.encode() + b"\n" + len(data).to_bytes(8, "little") + data + b"\n"
    return key.encode() + b"=" + data + b"\n"
