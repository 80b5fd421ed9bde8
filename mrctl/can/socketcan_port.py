"""SocketCAN at the speed of the tick, and through everything that happens to an interface.

python-can opens the socket; frames then go through the raw socket, four times faster than python-can's
messages. What the kernel does (net/can/raw.c), and what follows:

- a full receive buffer drops frames in silence: SO_RXQ_OVFL counts them, and the buffer is made large;
- after a stop (SIGSTOP, a hung system) thousands of old frames wait, or a few on a bus that died meanwhile:
  by the kernel's time stamps those that are stale are thrown away, so that none passes for fresh;
- CAN FD frames reach a socket only where it asks for them: it does, so that they are counted;
- an interface that goes down reports ENETDOWN once, and the same socket works when it is up again;
- an interface that is removed reports ENODEV once, forgets the socket's filters and unbinds it: filters and
  bind() must be repeated once it is there again, tried every 100 ms.
"""

from __future__ import annotations

import contextlib
import errno
import socket
import struct
import sys
import time
from collections.abc import Callable, Collection
from enum import Enum
from typing import Any, Final, Protocol

from mrctl.can import linux
from mrctl.can.ports import FRAMES_PER_CALL, STALE_AFTER_S, EventLog, LinkEvent, PortCounters
from mrctl.can.quiet_import import can
from mrctl.can.specs import ERROR_FLAG, FD_FLAG
from mrctl.errors import BusError

RETRY_S: Final = 0.1
RECEIVE_BUFFER_BYTES: Final = 4 << 20
STALE_CALLS_MAX: Final = 64
"""receive() throws away at most so many times FRAMES_PER_CALL stale frames at once."""

_DOWN: Final = frozenset({errno.ENETDOWN})
_GONE: Final = frozenset({errno.ENODEV, errno.ENXIO})
_LONGEST: Final = linux.FD_FRAME.size
_CLASSIC: Final = linux.CLASSIC_FRAME.size
_CLASSIC_DATA: Final = 8
_ANCILLARY_BYTES: Final = socket.CMSG_SPACE(4)  # room for SO_RXQ_OVFL
_NO_SOCKETCAN: Final = frozenset({errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT})


class _Link(Enum):
    UP = "up"
    DOWN = "down"
    GONE = "gone"


# Bound once, for what runs in every tick.
_UP: Final = _Link.UP
_pack, _unpack = linux.CLASSIC_FRAME.pack, linux.CLASSIC_FRAME.unpack


class _Bus(Protocol):
    """What the port needs of python-can's SocketcanBus."""

    socket: Any

    def shutdown(self) -> None: ...


def open_socketcan(
    channel: str, wanted_ids: Collection[int], *, fd: bool, stale_after_s: float = STALE_AFTER_S
) -> SocketCanPort:
    """Open a SocketCAN interface. Raises BusError with the mend where it is missing or cannot do CAN FD."""
    virtual = channel.startswith("vcan")
    with contextlib.ExitStack() as undo:
        try:
            bus: Any = can.Bus(
                interface="socketcan",
                channel=channel,
                fd=fd,
                ignore_rx_error_frames=True,
                ignore_config=True,
            )
            undo.callback(bus.shutdown)
            if fd and not linux.can_carry_fd(bus.socket, channel):
                mend = "mtu 72" if virtual else "type can bitrate 500000 dbitrate 2000000 fd on"
                raise BusError(
                    f"CAN interface {channel} is not set up for CAN FD; set it down, "
                    f"sudo ip link set {channel} {mend}, and up again"
                )
            port = SocketCanPort(bus, channel, wanted_ids, fd=fd, stale_after_s=stale_after_s)
        except (OSError, can.CanError) as error:
            number = getattr(error, "errno", None)
            if number in _GONE:
                see = f"sudo ip link add {channel} type vcan" if virtual else "see ip link show type can"
                raise BusError(f"there is no CAN interface {channel}; {see}") from error
            if number in _NO_SOCKETCAN:
                mend = "sudo modprobe can-raw, or take another interface, such as virtual"
                raise BusError(f"CAN interface {channel}: this kernel has no SocketCAN; {mend}") from error
            raise BusError(f"CAN interface {channel} cannot be opened: {error}; check its name") from error
        undo.pop_all()
    return port


class SocketCanPort:
    """A port on a SocketCAN interface, which it survives: down, up, removed, added again."""

    def __init__(
        self,
        bus: _Bus,
        channel: str,
        wanted_ids: Collection[int],
        *,
        fd: bool = False,
        stale_after_s: float = STALE_AFTER_S,
        clock_s: Callable[[], float] = time.monotonic,
        wall_clock_s: Callable[[], float] = time.time,
    ) -> None:
        self.counters = PortCounters()
        self.channel = channel
        self._bus = bus
        self._socket = bus.socket
        self._fd = fd
        self._stale_after_s = stale_after_s
        self._clock_s = clock_s
        self._wall_clock_s = wall_clock_s
        self._filters = b"".join(linux.receive_filter(can_id) for can_id in sorted(set(wanted_ids)))
        self._events = EventLog()
        self._link = _Link.UP
        self._retry_at_s = 0.0
        self._asked_at_s = clock_s()
        self._refusing = False
        self._receive_failing = False
        self._dropped_before = 0
        self._last_bus_event = "bus_restarted"
        self._prepare()

    def receive(self) -> list[tuple[int, bytes]]:
        """Everything that waits, but for stale frames; see Port."""
        now_s = self._clock_s()
        since_s, self._asked_at_s = now_s - self._asked_at_s, now_s
        if since_s > self._stale_after_s:
            frames = self._receive_fresh()
        else:
            frames = self._receive()
            # Held up meanwhile, or with more behind the last of these, which is stale: then all may be.
            held_up = self._clock_s() - now_s > self._stale_after_s
            if held_up or (len(frames) == FRAMES_PER_CALL and self._last_is_stale()):
                frames = self._receive_fresh(len(frames))
        self.counters.received += len(frames)
        return frames

    def discard(self) -> None:
        """Throw away all that waits; see Port."""
        self._asked_at_s = self._clock_s()
        for _ in range(STALE_CALLS_MAX):
            thrown = len(self._receive())
            self.counters.stale += thrown
            if thrown < FRAMES_PER_CALL:
                break

    def _receive(self, limit: int = FRAMES_PER_CALL) -> list[tuple[int, bytes]]:
        if self._link is not _UP:
            self._try_again()
        frames: list[tuple[int, bytes]] = []
        recvmsg = self._socket.recvmsg
        for _ in range(limit):
            try:
                frame, ancillary, _flags, _address = recvmsg(_LONGEST, _ANCILLARY_BYTES)
            except BlockingIOError:
                break
            except OSError as error:
                if self._receive_failed(error):
                    continue
                break
            self._receive_failing = False
            if ancillary:
                self._count_dropped(ancillary)
            if len(frame) == _CLASSIC:
                can_id, length, data = _unpack(frame)
                if length < _CLASSIC_DATA:
                    data = data[:length]
                if can_id & ERROR_FLAG:
                    self._bus_error(can_id, data)
            else:
                can_id, data = self._fd_frame(frame)
            frames.append((can_id, data))
        return frames

    def _receive_failed(self, error: OSError) -> bool:
        """Whether to go on: news of the link are said once, and what was queued before is still there."""
        if self._link_failed(error):
            return True
        if error.errno not in _DOWN | _GONE and not self._receive_failing:
            self._receive_failing = True
            self._events.add("receive_failed", f"{self.channel}: {error.strerror}")
        return False

    def _fd_frame(self, frame: bytes) -> tuple[int, bytes]:
        can_id, length = linux.HEADER.unpack_from(frame)
        data = frame[linux.DATA_OFFSET : linux.DATA_OFFSET + length]
        return (can_id if self._fd else can_id | FD_FLAG), data

    def _last_is_stale(self) -> bool:
        """Whether the frame read last had waited for too long; not in a kernel without time stamps.

        Both clocks are the wall clock, so its steps only concern what waits when it steps.
        """
        with contextlib.suppress(OSError):
            return self._wall_clock_s() - linux.last_stamp_s(self._socket) > self._stale_after_s
        return False

    def _receive_fresh(self, thrown: int = 0) -> list[tuple[int, bytes]]:
        """Frame by frame, after nobody has asked for a while: few may wait, and all of them be old.

        thrown: how many were read and thrown away before.
        """
        fresh: list[tuple[int, bytes]] = []
        for _ in range(STALE_CALLS_MAX * FRAMES_PER_CALL):
            one = self._receive(1) or self._receive(1)  # the first may have been news of the link
            if not one:
                break
            if self._last_is_stale():
                thrown += 1
                continue
            fresh += one
            if len(fresh) == FRAMES_PER_CALL:
                break
        self._tell_stale(thrown)
        return fresh

    def _tell_stale(self, thrown: int) -> None:
        if thrown:
            self.counters.stale += thrown
            self._events.add("frames_stale", f"{self.channel}: {thrown} frames had waited for too long")

    def send(self, can_id: int, data: bytes) -> bool:
        """Queue a frame; see Port."""
        length = len(data)
        try:
            if self._fd:
                self._socket.send(linux.FD_FRAME.pack(can_id, length, linux.BIT_RATE_SWITCH, data))
            else:
                self._socket.send(_pack(can_id, length, data))
        except OSError as error:
            self.counters.send_failed += 1
            self._link_failed(error)
            if not self._refusing and self._link is _Link.UP:
                self._refusing = True
                self._events.add("send_refused", f"{self.channel}: {error.strerror}")
            return False
        self.counters.sent += 1
        if self._refusing:
            self._refusing = False
            self._events.add("send_resumed", f"{self.channel} takes frames again")
        return True

    def take_events(self) -> list[LinkEvent]:
        """What happened to the link since the last call."""
        return self._events.take()

    def close(self) -> None:
        """Close the socket."""
        self._bus.shutdown()

    def _prepare(self) -> None:
        """Set the socket up once: it never waits, says what it drops, and holds a long burst."""
        self._socket.setblocking(False)
        for option, value in (
            (linux.SO_TIMESTAMPNS, 0),  # python-can asks for one beside each frame; see last_stamp_s
            (linux.SO_RXQ_OVFL, 1),
            (socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES),
            (linux.SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES),  # beyond rmem_max: for those who may
        ):
            with contextlib.suppress(OSError):
                self._socket.setsockopt(socket.SOL_SOCKET, option, value)
        with contextlib.suppress(OSError):
            linux.last_stamp_s(self._socket)
        self._set_filters()
        try:
            if not linux.interface_is_up(self._socket, self.channel):
                self._set_link(_Link.DOWN)
        except OSError as error:
            self._link_failed(error)

    def _set_filters(self) -> None:
        errors = struct.pack("=I", linux.ERR_CONTROLLER | linux.ERR_BUS_OFF | linux.ERR_RESTARTED)
        self._socket.setsockopt(linux.SOL_CAN_RAW, linux.CAN_RAW_FD_FRAMES, 1)
        self._socket.setsockopt(linux.SOL_CAN_RAW, linux.CAN_RAW_ERR_FILTER, errors)
        self._socket.setsockopt(linux.SOL_CAN_RAW, linux.CAN_RAW_FILTER, self._filters)

    def _link_failed(self, error: OSError) -> bool:
        """Follow an error that tells of the link; True when that changed what is known of it."""
        before = self._link
        if error.errno in _GONE:
            self._set_link(_Link.GONE)
        elif error.errno in _DOWN and before is _Link.UP:
            self._set_link(_Link.DOWN)
        return self._link is not before

    def _set_link(self, link: _Link) -> None:
        if link is self._link:
            return
        before, self._link = self._link, link
        if link is _Link.UP:
            self.counters.reopened += 1
            self._events.add("link_up", f"{self.channel} is up")
            return
        if before is _Link.UP:
            self.counters.down += 1
            self._retry_at_s = self._clock_s() + RETRY_S
        if link is _Link.GONE:
            self._events.add("link_gone", f"{self.channel} was removed; trying to bind every {RETRY_S:g} s")
        elif before is _Link.GONE:
            self._events.add("link_back", f"{self.channel} is there again")
        else:
            self._events.add("link_down", f"{self.channel} is down; ip link set {self.channel} up")

    def _try_again(self) -> None:
        now_s = self._clock_s()
        if now_s < self._retry_at_s:
            return
        self._retry_at_s = now_s + RETRY_S
        # Read and clear what the kernel still has to say, lest it be taken for news after the mend.
        if self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) in _GONE:
            self._set_link(_Link.GONE)
        try:
            if self._link is _Link.GONE:
                self._set_filters()  # first, so that nothing unwanted slips in between
                self._socket.bind((self.channel,))
                self._set_link(_Link.DOWN)
            if linux.interface_is_up(self._socket, self.channel):
                self._set_link(_Link.UP)
        except OSError as error:
            self._link_failed(error)

    def _count_dropped(self, ancillary: list[tuple[int, int, bytes]]) -> None:
        for level, kind, data in ancillary:
            if level == socket.SOL_SOCKET and kind == linux.SO_RXQ_OVFL:
                # The kernel counts up from 0 and wraps at 32 bits.
                total = int.from_bytes(data[:4], sys.byteorder)
                lost = total - self._dropped_before & 0xFFFFFFFF
                if lost:
                    self._dropped_before = total
                    self.counters.dropped += lost
                    self._events.add("frames_dropped", f"{self.channel}: {lost} frames lost, buffer full")

    def _bus_error(self, can_id: int, data: bytes) -> None:
        self.counters.error_frames += 1
        if can_id & linux.ERR_BUS_OFF:
            kind, detail = "bus_off", "is off the bus; with `type can restart-ms 100` it comes back by itself"
        elif can_id & linux.ERR_RESTARTED:
            kind, detail = "bus_restarted", "is back on the bus"
        elif can_id & linux.ERR_CONTROLLER and len(data) > 1 and data[1] & linux.CONTROLLER_PASSIVE:
            kind, detail = "bus_errors", "is error-passive: check wiring, termination and bit rate"
        else:
            return
        if kind != self._last_bus_event:
            self._last_bus_event = kind
            self._events.add(kind, f"the controller of {self.channel} {detail}")
