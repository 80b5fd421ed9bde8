"""End-to-end protection of a frame: CRC-8, counter and data ID, as AUTOSAR E2E Profile 2 (and 22) has them.

    byte 0              CRC-8, polynomial 0x2F, start 0xFF, final xor 0xFF, over bytes 1... and the data ID
    byte 1, low nibble  counter 0 to 15, also the index of the data ID in its list of 16

Source: AUTOSAR FO, "E2E Protocol Specification", PRS_E2EProtocol, profile 2. The CRC alone finds every error
of up to three bits in 8 bytes (0x1D, as in profiles 1 and 11, misses 198 of 41,664 errors of three bits).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

COUNTERS: Final = 16
"""Values of the counter, and so data IDs of a frame."""
_POLYNOMIAL: Final = 0x2F


def _crc_of_byte(byte: int) -> int:
    for _ in range(8):
        byte = (byte << 1 ^ _POLYNOMIAL) & 0xFF if byte & 0x80 else byte << 1
    return byte


CRC8_2F: Final = tuple(_crc_of_byte(byte) for byte in range(256))  # no bytes: Python looks up a tuple faster


def crc(data: Sequence[int], data_id: int) -> int:
    """The CRC-8 that belongs into byte 0 of the frame `data` (byte 0 itself is not read)."""
    table = CRC8_2F
    if len(data) == 8:  # nearly every frame: unrolled, half the time
        _, b1, b2, b3, b4, b5, b6, b7 = data
        remainder = table[table[table[table[table[table[b1 ^ 0xFF] ^ b2] ^ b3] ^ b4] ^ b5] ^ b6] ^ b7
        return table[table[remainder] ^ data_id] ^ 0xFF
    remainder = 0xFF
    for byte in data[1:]:
        remainder = table[remainder ^ byte]
    return table[remainder ^ data_id] ^ 0xFF


def protect(data: bytearray, data_ids: bytes, counter: int) -> None:
    """Put counter and CRC into a frame, in place.

    data: at least 2 bytes; byte 0 and the low nibble of byte 1 are overwritten. data_ids: 16 bytes, one for
    each counter. counter: any integer, its low 4 bits count.
    """
    counter &= 0xF
    data[1] = data[1] & 0xF0 | counter
    data[0] = crc(data, data_ids[counter])


def check(data: bytes, data_ids: bytes) -> bool:
    """True when the CRC fits content, counter and data ID of a received frame; False for under 2 bytes."""
    table = CRC8_2F
    if len(data) == 8:  # written out once more: the call of crc() would cost a third of the time
        b0, b1, b2, b3, b4, b5, b6, b7 = data
        remainder = table[table[table[table[table[table[b1 ^ 0xFF] ^ b2] ^ b3] ^ b4] ^ b5] ^ b6] ^ b7
        return table[table[remainder] ^ data_ids[b1 & 0xF]] == b0 ^ 0xFF
    return len(data) >= 2 and crc(data, data_ids[data[1] & 0xF]) == data[0]


def counter_of(data: bytes) -> int:
    """The counter of a frame, 0 to 15."""
    return data[1] & 0xF


def counter_delta(counter: int, previous: int) -> int:
    """Steps from the previous counter to this one: 0 is a repeated frame, 1 the next, n > 1: n - 1 lost."""
    return counter - previous & 0xF
