"""How much of a bus the frames take at worst: every stuff bit counted, three bits of silence after a frame.

Classic frames: Davis, Burns, Bril, Lukkien, "Controller Area Network (CAN) schedulability analysis: refuted,
revisited and revised", Real-Time Systems 35 (2007): with g header bits under stuffing (34, or 54 with an
extended identifier) and s bytes at most g + 8s + 13 + floor((g + 8s - 1) / 4) bits, the interframe space
included. FD frames: the same bound for dynamic stuffing, on the fields of ISO 11898-1:2015, and the fixed
stuff bits of their CRC field.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

LIMIT: Final = 0.6
"""Of the bus, all frames together: beyond it the lowest priorities wait too long."""

_FD_LENGTHS: Final = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)


class FrameRate(NamedTuple):
    """A frame and how often it is sent."""

    name: str
    length: int
    extended: bool
    rate_hz: float


class Bits(NamedTuple):
    """Bits of one frame at worst, at the bit rate of the arbitration and at that of the data phase."""

    nominal: int
    data: int


@dataclass(frozen=True, slots=True)
class FrameLoad:
    """What one frame takes of the bus."""

    name: str
    rate_hz: float
    bits: Bits
    duration_s: float
    fraction: float


@dataclass(frozen=True, slots=True)
class BusLoad:
    """What all frames take of the bus; `total` is a fraction, 1 is a full bus."""

    frames: tuple[FrameLoad, ...]
    total: float


def classic_bits(length: int, *, extended: bool) -> Bits:
    """The longest that a classic frame of 0 to 8 bytes can be. Raises ValueError for other lengths."""
    if not 0 <= length <= 8:
        raise ValueError(f"a classic CAN frame has 0 to 8 bytes, not {length}")
    stuffed = (54 if extended else 34) + 8 * length
    return Bits(stuffed + 13 + (stuffed - 1) // 4, 0)


def fd_bits(length: int, *, extended: bool) -> Bits:
    """The longest that a CAN FD frame with a bit rate switch can be. Raises ValueError for over 64 bytes.

    A payload between two lengths that CAN FD has is filled up to the longer one. The CRC delimiter, where the
    rate switches back, counts at the nominal rate, the bit that switches it up too.
    """
    if not 0 <= length <= _FD_LENGTHS[-1]:
        raise ValueError(f"a CAN FD frame has 0 to {_FD_LENGTHS[-1]} bytes, not {length}")
    payload = 8 * next(allowed for allowed in _FD_LENGTHS if allowed >= length)
    # Nominal: start, 11 bits, RRS, IDE, FDF, res, BRS; extended: SRR, 18 bits more. Data: ESI, DLC, payload.
    arbitration = 36 if extended else 17
    dynamic = arbitration + 5 + payload
    stuff_in_arbitration = (arbitration - 1) // 4  # as many as can be in the slow part
    stuff_in_data = (dynamic - 1) // 4 - stuff_in_arbitration
    check = 4 + (17 if payload <= 128 else 21)  # stuff count with parity, CRC
    fixed_stuff = 1 + (check - 1) // 4  # one before the field and one after every four bits
    tail = 1 + 2 + 7 + 3  # CRC delimiter, acknowledge slot and delimiter, end of frame, interframe space
    return Bits(arbitration + stuff_in_arbitration + tail, 5 + payload + stuff_in_data + check + fixed_stuff)


def bus_load(frames: Iterable[FrameRate], bitrate: float, data_bitrate: float | None = None) -> BusLoad:
    """Worst-case load of a bus, for each frame and in total.

    bitrate, data_bitrate: bit/s; with a data_bitrate all frames are CAN FD with a bit rate switch.
    """
    loads = []
    for frame in frames:
        if data_bitrate is None:
            bits = classic_bits(frame.length, extended=frame.extended)
            duration_s = bits.nominal / bitrate
        else:
            bits = fd_bits(frame.length, extended=frame.extended)
            duration_s = bits.nominal / bitrate + bits.data / data_bitrate
        loads.append(FrameLoad(frame.name, frame.rate_hz, bits, duration_s, duration_s * frame.rate_hz))
    return BusLoad(tuple(loads), sum(load.fraction for load in loads))
