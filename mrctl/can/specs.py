"""What a DBC says about a frame, as plain data: all that codecs, tick and bus load need to know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

# The flags of Linux' canid_t, <linux/can.h>.
EXTENDED_FLAG: Final = 0x80000000
REMOTE_FLAG: Final = 0x40000000
ERROR_FLAG: Final = 0x20000000
# Not of Linux, which tells them by their size: a CAN FD frame on a port that is for classic ones.
FD_FLAG: Final = 0x1_00000000


@dataclass(frozen=True, slots=True)
class SignalSpec:
    """One signal: physical value = raw * factor + offset; the raw value `sna_raw` says "not available"."""

    name: str
    start_bit: int
    """As the DBC counts: the least significant bit (little endian), the most significant one (big endian)."""
    bits: int
    signed: bool
    factor: float
    offset: float
    minimum: float
    maximum: float
    unit: str
    sna_raw: int | None
    raw_minimum: int
    """An encoder sends raw values from raw_minimum to raw_maximum, which never include the SNA value."""
    raw_maximum: int
    big_endian: bool = False

    def shift(self, length: int) -> int:
        """Bits to the right of the signal, where `length` bytes are read as one integer of its byte order."""
        if not self.big_endian:
            return self.start_bit
        from_the_top = self.start_bit // 8 * 8 + 7 - self.start_bit % 8
        return 8 * length - from_the_top - self.bits

    @property
    def mask(self) -> int:
        """Ones, as many as the signal has bits."""
        return (1 << self.bits) - 1

    def placed(self, raw: int, length: int) -> bytes:
        """A payload of `length` bytes that holds this raw value and nothing else."""
        return ((raw & self.mask) << self.shift(length)).to_bytes(
            length, "big" if self.big_endian else "little"
        )


@dataclass(frozen=True, slots=True)
class FrameSpec:
    """One frame: `signals` are the payload signals that the caller asked for, in the caller's order."""

    name: str
    can_id: int
    extended: bool
    length: int
    cycle_s: float | None
    """Seconds between two frames; None where the DBC has no GenMsgCycleTime."""
    data_ids: bytes
    signals: tuple[SignalSpec, ...]
    background: bytes
    """The payload before any of `signals` is written: what nobody asked for says "not available", or 0."""

    @property
    def linux_id(self) -> int:
        """The identifier as SocketCAN has it: bit 31 set for an extended one."""
        return self.can_id | EXTENDED_FLAG if self.extended else self.can_id
