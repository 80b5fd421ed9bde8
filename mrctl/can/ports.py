"""The bus behind a small port, so that tick and loop know neither sockets nor drivers.

`open_port` gives the port for an interface name of python-can: SocketCanPort for `socketcan`, PythonCanPort
for every other (`virtual`, `udp_multicast`, the drivers of vendors).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

FRAMES_PER_CALL: Final = 256
"""receive() gives at most so many at once: rubbish at full speed must not hold up the tick for ever."""

STALE_AFTER_S: Final = 0.1

_EVENTS_KEPT: Final = 64


class LinkEvent(NamedTuple):
    """Something happened to the link, for the log. kind: one of LINK_EVENTS; detail: a sentence."""

    kind: str
    detail: str


LINK_EVENTS: Final = {
    "link_down": "the interface went down",
    "link_up": "the interface is up again",
    "link_gone": "the interface was removed",
    "link_back": "the interface is there again and the port is bound to it",
    "send_refused": "a frame could not be queued, the first of a row",
    "send_resumed": "frames can be queued again",
    "frames_dropped": "the receive buffer was full and frames were lost",
    "frames_stale": "frames had waited for too long and were thrown away",
    "bus_off": "the controller took itself off the bus",
    "bus_restarted": "the controller is back on the bus",
    "bus_errors": "the controller counts many errors",
    "receive_failed": "the driver failed to receive",
}


@dataclass(slots=True)
class PortCounters:
    """What went through a port since it was opened."""

    received: int = 0
    sent: int = 0
    send_failed: int = 0
    dropped: int = 0
    """Frames that the kernel dropped because the receive buffer was full."""
    stale: int = 0
    """Frames thrown away unread: they had waited for too long, or since before the start."""
    error_frames: int = 0
    down: int = 0
    """How often the interface went down or away."""
    reopened: int = 0
    """How often it came back."""


class EventLog:
    """Link events until somebody takes them; the oldest go when nobody does."""

    def __init__(self) -> None:
        self._events: deque[LinkEvent] = deque(maxlen=_EVENTS_KEPT)

    def add(self, kind: str, detail: str) -> None:
        """Note an event; kind is one of LINK_EVENTS."""
        self._events.append(LinkEvent(kind, detail))

    def take(self) -> list[LinkEvent]:
        """The events since the last call, oldest first."""
        if not self._events:
            return []
        events = list(self._events)
        self._events.clear()
        return events


class Port(Protocol):
    """A CAN bus as the loop sees it. No call blocks, and none raises for what happens on the bus."""

    counters: PortCounters

    def receive(self) -> list[tuple[int, bytes]]:
        """Everything that waits, oldest first, at most FRAMES_PER_CALL: (identifier, payload).

        The identifier is Linux' canid_t: bit 31 extended, bit 30 remote frame, bit 29 error frame; bit 32 is
        a CAN FD frame on a port for classic ones.
        """

    def discard(self) -> None:
        """Throw away unread all that waits: what came before anybody was ready for it is not fresh."""

    def send(self, can_id: int, data: bytes) -> bool:
        """Queue a frame (bit 31 of can_id: extended); False when it could not be queued."""

    def take_events(self) -> list[LinkEvent]:
        """What happened to the link since the last call."""

    def close(self) -> None:
        """Give the bus back; the port is of no use afterwards."""


def open_port(
    interface: str,
    channel: str,
    bitrate: int,
    fd: bool,  # noqa: FBT001  # the four words of a bus in the configuration, in their order
    wanted_ids: Iterable[int],
    *,
    data_bitrate: int | None = None,
    stale_after_s: float = STALE_AFTER_S,
) -> Port:
    """Open a bus and give its port.

    interface, channel: as python-can names them, for example `socketcan` and `can0`. bitrate, data_bitrate:
    bit/s; SocketCAN ignores them, its interface has been set up by the system. fd: send CAN FD frames with a
    bit rate switch, receive such too. wanted_ids: identifiers to receive, bit 31 set for extended ones; no
    other data frame comes through. stale_after_s: frames that waited for longer, behind FRAMES_PER_CALL
    others or while nobody asked for them, are thrown away, as is all that a held-up call read (SocketCAN
    only, by the kernel's time stamps).
    Raises BusError with the mend where the bus cannot be opened.
    """
    wanted = frozenset(wanted_ids)
    if interface == "socketcan":
        from mrctl.can.socketcan_port import open_socketcan  # noqa: PLC0415  # each bus loads its own driver only

        return open_socketcan(channel, wanted, fd=fd, stale_after_s=stale_after_s)
    from mrctl.can.python_can_port import open_python_can  # noqa: PLC0415  # as above

    return open_python_can(interface, channel, wanted, bitrate=bitrate, data_bitrate=data_bitrate, fd=fd)
