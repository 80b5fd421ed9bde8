"""Words to systemd over its notification socket (sd_notify(3)); silent where there is none."""

from __future__ import annotations

import contextlib
import os
import socket


class Notifier:
    """Sends READY, STATUS, WATCHDOG and STOPPING to the service manager, without waiting."""

    def __init__(self) -> None:
        self._socket: socket.socket | None = None
        address = os.environ.get("NOTIFY_SOCKET", "")
        if address[:1] in ("/", "@"):
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)
            self._address = "\0" + address[1:] if address[0] == "@" else address

    def tell(self, *lines: str) -> None:
        """Send lines such as `READY=1`; one that cannot be sent at once is dropped."""
        if self._socket is not None:
            # A full queue or a manager that is restarting must not stop the tick; the watchdog sees silence.
            with contextlib.suppress(OSError):
                self._socket.sendto("\n".join(lines).encode(), self._address)

    @staticmethod
    def watchdog_s() -> float | None:
        """The time within which the manager wants to hear WATCHDOG=1, or None."""
        microseconds = os.environ.get("WATCHDOG_USEC", "")
        for_this_process = os.environ.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        return int(microseconds) / 1e6 if microseconds.isdigit() and for_this_process else None
