"""One signal out of a payload, without code made for it: for a compiled build."""

from __future__ import annotations

import math

from mrctl.can.specs import SignalSpec


class SignalReader:
    """Reads one signal of a frame of a known length."""

    __slots__ = (
        "_big_endian",
        "_down",
        "_factor",
        "_first",
        "_last",
        "_mask",
        "_not_available",
        "_offset",
        "_sign",
        "_turn",
    )

    def __init__(self, signal: SignalSpec, length: int) -> None:
        """length: of the frame, in bytes."""
        shift = signal.shift(length)
        low, high = shift // 8, (shift + signal.bits - 1) // 8  # bytes, from the word's low end
        self._big_endian = signal.big_endian
        self._first, self._last = (length - 1 - high, length - 1 - low) if signal.big_endian else (low, high)
        self._down = shift - 8 * low
        self._mask = signal.mask
        self._not_available = -1 if signal.sna_raw is None else signal.sna_raw & signal.mask
        self._turn = 1 << signal.bits
        self._sign = self._turn // 2 if signal.signed else self._turn
        self._factor, self._offset = signal.factor, signal.offset

    def read(self, data: bytes) -> float:
        """The physical value; NaN for "not available"."""
        raw, first, last = 0, self._first, self._last
        if self._big_endian:
            for k in range(first, last + 1):
                raw = raw << 8 | data[k]
        else:
            for k in range(last, first - 1, -1):
                raw = raw << 8 | data[k]
        raw = raw >> self._down & self._mask
        if raw == self._not_available:
            return math.nan
        if raw >= self._sign:
            raw -= self._turn
        value = raw * self._factor
        return value + self._offset if self._offset else value
