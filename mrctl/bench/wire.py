"""A socket without a kernel: CAN frames as the kernel hands them over, for what is above it to be timed."""

from __future__ import annotations

import socket
import struct
import time
from collections import deque

from mrctl.can import linux

_TIMESTAMP = struct.Struct("@ll")
_SOL_SOCKET = 1
INTERFACE = "lo"
Received = tuple[bytes, list[tuple[int, int, bytes]], int, tuple[str]]


class Wire:
    """Gives the frames that were laid on it to `recvmsg`, and forgets what is sent."""

    def __init__(self, *, stamped: bool) -> None:
        """stamped: with the kernel's time stamp beside each frame, which python-can asks for."""
        self._waiting: deque[Received] = deque()
        self._stamped = stamped
        # A port asks the kernel whether its interface is up; the loopback interface is.
        self._kernel = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)

    def fileno(self) -> int:
        """A descriptor to ask the kernel on."""
        return self._kernel.fileno()

    def lay(self, can_id: int, data: bytes) -> None:
        """A frame arrives."""
        seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
        stamp = [(_SOL_SOCKET, linux.SO_TIMESTAMPNS, _TIMESTAMP.pack(seconds, nanoseconds))]
        frame = linux.CLASSIC_FRAME.pack(can_id, len(data), data)
        self._waiting.append((frame, stamp if self._stamped else [], 0, ("vcan0",)))

    def recvmsg(self, _size: int, _ancillary: int) -> Received:
        """The next frame; BlockingIOError when there is none."""
        if not self._waiting:
            raise BlockingIOError
        return self._waiting.popleft()

    def send(self, data: bytes) -> int:
        """A frame leaves."""
        return len(data)

    def setblocking(self, _flag: bool) -> None:  # noqa: FBT001  # a socket's own signature
        """As a socket's; nothing to set."""

    def setsockopt(self, *_option: object) -> None:
        """As a socket's; nothing to set."""

    def getsockopt(self, *_option: object) -> int:
        """As a socket's."""
        return 1 << 22


class WireBus:
    """What a port needs of python-can's bus, on a wire."""

    def __init__(self, wire: Wire) -> None:
        self.socket = wire

    def shutdown(self) -> None:
        """Nothing to shut down."""
