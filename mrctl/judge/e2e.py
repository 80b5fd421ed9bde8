"""AUTOSAR E2E profile 2, from its specification (PRS_E2EProtocol): CRC-8H2F and a 4-bit counter.

CRC-8H2F: polynomial 0x2F, start value 0xFF, final xor 0xFF, nothing reflected; check value of "123456789" is
0xDF. It covers bytes 1 and up, then the data ID that the counter selects.
"""

from __future__ import annotations


def crc8h2f(data: bytes) -> int:
    """The CRC of a message, by the book: bit by bit, as a shift register does it."""
    register = 0xFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            high = register & 0x80
            register = register << 1 & 0xFF
            if high:
                register ^= 0x2F
    return register ^ 0xFF


_STEP = tuple(
    crc8h2f(bytes([byte ^ 0xFF])) ^ 0xFF for byte in range(256)
)  # what one byte does to a register of 0


def expected_crc(data: bytes, data_ids: bytes) -> int:
    """What byte 0 of a frame of at least two bytes must be."""
    register = 0xFF
    for byte in data[1:]:
        register = _STEP[register ^ byte]
    return _STEP[register ^ data_ids[data[1] % 16]] ^ 0xFF
