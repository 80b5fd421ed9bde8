"""Every bus of python-can but SocketCAN: `virtual` in tests, `udp_multicast`, the adapters of vendors."""

from __future__ import annotations

import contextlib
from collections.abc import Collection
from typing import Any, Final

from mrctl.can.ports import FRAMES_PER_CALL, EventLog, LinkEvent, PortCounters
from mrctl.can.quiet_import import can
from mrctl.can.specs import ERROR_FLAG, EXTENDED_FLAG, FD_FLAG, REMOTE_FLAG
from mrctl.errors import BusError

DISCARDED_MAX: Final = 1 << 16
"""discard() throws away at most so many frames: a bus at full speed never ends."""


def open_python_can(
    interface: str,
    channel: str,
    wanted_ids: Collection[int],
    *,
    bitrate: int,
    data_bitrate: int | None,
    fd: bool,
) -> PythonCanPort:
    """Open a bus with python-can. Raises BusError with the mend where there is no such bus."""
    if interface not in can.interfaces.VALID_INTERFACES:
        known = ", ".join(sorted(can.interfaces.VALID_INTERFACES))
        raise BusError(f"python-can knows no interface {interface}; use one of: {known}")
    options: dict[str, Any] = {"bitrate": bitrate, "fd": fd}
    if fd and data_bitrate is not None:
        options["data_bitrate"] = data_bitrate
    try:
        bus = can.Bus(interface=interface, channel=channel, ignore_config=True, **options)
    except (OSError, can.CanError, ImportError, ValueError, TypeError, AttributeError, NameError) as error:
        # The drivers of vendors raise all of these, mostly where their library is not installed.
        what = " ".join(str(error).split()) or type(error).__name__
        raise BusError(
            f"CAN bus {interface} {channel} cannot be opened: {what}; check channel and driver"
        ) from error
    return PythonCanPort(bus, wanted_ids, fd=fd)


class PythonCanPort:
    """A port on a bus of python-can."""

    def __init__(self, bus: can.BusABC, wanted_ids: Collection[int], *, fd: bool = False) -> None:
        self.counters = PortCounters()
        self._bus = bus
        # python-can's own filters would end a receive at the first unwanted frame.
        self._wanted = frozenset(wanted_ids)
        self._fd = fd
        self._events = EventLog()
        self._refusing = False
        self._receive_failing = False

    def receive(self) -> list[tuple[int, bytes]]:
        """Everything that waits; see Port."""
        frames: list[tuple[int, bytes]] = []
        for _ in range(FRAMES_PER_CALL):
            try:
                message = self._bus.recv(timeout=0)
            except (can.CanError, OSError) as error:
                if not self._receive_failing:
                    self._receive_failing = True
                    self._events.add("receive_failed", f"{self._bus.channel_info}: {error}")
                break
            self._receive_failing = False
            if message is None:
                break
            can_id = message.arbitration_id | (EXTENDED_FLAG if message.is_extended_id else 0)
            if message.is_error_frame:
                self.counters.error_frames += 1
                frames.append((can_id | ERROR_FLAG, bytes(message.data)))
            elif can_id in self._wanted and message.is_rx:
                if message.is_remote_frame:
                    can_id |= REMOTE_FLAG
                elif message.is_fd and not self._fd:
                    can_id |= FD_FLAG
                frames.append((can_id, bytes(message.data)))
        self.counters.received += len(frames)
        return frames

    def discard(self) -> None:
        """Throw away all that waits; see Port."""
        with contextlib.suppress(can.CanError, OSError):  # the first receive() tells of it
            for _ in range(DISCARDED_MAX):
                if self._bus.recv(timeout=0) is None:
                    break
                self.counters.stale += 1

    def send(self, can_id: int, data: bytes) -> bool:
        """Queue a frame; see Port."""
        message = can.Message(
            arbitration_id=can_id & ~EXTENDED_FLAG,
            is_extended_id=bool(can_id & EXTENDED_FLAG),
            data=data,
            is_fd=self._fd,
            bitrate_switch=self._fd,
        )
        try:
            self._bus.send(message, timeout=0)
        except (can.CanError, OSError) as error:
            self.counters.send_failed += 1
            if not self._refusing:
                self._refusing = True
                self._events.add("send_refused", f"{self._bus.channel_info}: {error}")
            return False
        self.counters.sent += 1
        if self._refusing:
            self._refusing = False
            self._events.add("send_resumed", f"{self._bus.channel_info} takes frames again")
        return True

    def take_events(self) -> list[LinkEvent]:
        """What happened to the link since the last call."""
        return self._events.take()

    def close(self) -> None:
        """Give the bus back."""
        self._bus.shutdown()
