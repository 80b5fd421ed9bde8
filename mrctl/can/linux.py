"""Numbers and layouts of Linux' SocketCAN that Python's socket module does not have on every build.

Sources: <linux/can.h>, <linux/can/raw.h>, <linux/can/error.h>, <asm-generic/socket.h>, <linux/sockios.h>.
"""

from __future__ import annotations

import fcntl
import struct
from typing import Any, Final

from mrctl.can.specs import EXTENDED_FLAG

HEADER: Final = struct.Struct("=IB")  # struct can_frame and canfd_frame: identifier, length
CLASSIC_FRAME: Final = struct.Struct("=IB3x8s")
FD_FRAME: Final = struct.Struct("=IBB2x64s")  # identifier, length, flags, payload
DATA_OFFSET: Final = 8
BIT_RATE_SWITCH: Final = 0x01

SOL_CAN_RAW: Final = 101
CAN_RAW_FILTER: Final = 1
CAN_RAW_ERR_FILTER: Final = 2
ERR_CONTROLLER: Final = 0x004
ERR_BUS_OFF: Final = 0x040
ERR_RESTARTED: Final = 0x100
CONTROLLER_PASSIVE: Final = 0x30  # in data[1] of a controller error

CAN_RAW_FD_FRAMES: Final = 5

SO_RCVBUFFORCE: Final = 33
SO_TIMESTAMPNS: Final = 35
SO_RXQ_OVFL: Final = 40

_SIOCGSTAMPNS: Final = 0x8907
_SIOCGIFFLAGS: Final = 0x8913
_SIOCGIFMTU: Final = 0x8921
_IFF_UP: Final = 0x1
_TIMESPEC: Final = "@ll"
_STANDARD_MASK: Final = 0x7FF
_EXTENDED_MASK: Final = 0x1FFFFFFF


def receive_filter(can_id: int) -> bytes:
    """The kernel's filter (struct can_filter) for one identifier; its remote frames come through too."""
    mask = _EXTENDED_MASK if can_id & EXTENDED_FLAG else _STANDARD_MASK
    return struct.pack("=II", can_id, EXTENDED_FLAG | mask)


def interface_is_up(sock: Any, interface: str) -> bool:  # noqa: ANN401  # anything with fileno()
    """Ask the kernel whether an interface is up. Raises OSError (ENODEV) where it does not exist."""
    (flags,) = struct.unpack_from("=H", _interface_request(sock, interface, _SIOCGIFFLAGS), 16)
    return bool(flags & _IFF_UP)


def can_carry_fd(sock: Any, interface: str) -> bool:  # noqa: ANN401  # anything with fileno()
    """Ask the kernel whether an interface is set up for CAN FD. Raises OSError where it does not exist."""
    (mtu,) = struct.unpack_from("=i", _interface_request(sock, interface, _SIOCGIFMTU), 16)
    return bool(mtu >= FD_FRAME.size)


def last_stamp_s(sock: Any) -> float:  # noqa: ANN401  # as above
    """When the frame that was received last reached the kernel, in s of the wall clock.

    The first call on a socket turns the stamping on and raises OSError (ENOENT). A kernel without it raises
    OSError too.
    """
    stamp = fcntl.ioctl(sock.fileno(), _SIOCGSTAMPNS, bytes(struct.calcsize(_TIMESPEC)))
    seconds, nanoseconds = struct.unpack(_TIMESPEC, stamp)
    return float(seconds + nanoseconds / 1e9)


def _interface_request(sock: Any, interface: str, request: int) -> bytes:  # noqa: ANN401  # as above
    return fcntl.ioctl(sock.fileno(), request, struct.pack("16s24x", interface.encode()[:15]))
