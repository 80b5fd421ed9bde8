"""Percentiles of times in constant memory and at a constant cost, however many there are.

Bins as in an HDR histogram: 16 to an octave, so a percentile is right to 1/16 from a microsecond to an hour.
"""

from __future__ import annotations

from collections.abc import Sequence

_SUB_BITS = 4
_SUB = 1 << _SUB_BITS
_UNIT_NS = 1024  # about a microsecond, by a shift
_OCTAVES = 32
_BINS = (_OCTAVES - _SUB_BITS) * _SUB + _SUB


class Histogram:
    """Times in ns since the last `clear`."""

    __slots__ = ("_bins", "count", "max_ns")

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._bins = [0] * _BINS
        self.count = 0
        self.max_ns = 0

    def add(self, time_ns: int) -> None:
        """Count a time (a negative one, such as an early wake-up, as 0)."""
        if time_ns > self.max_ns:  # noqa: PLR1730  # max() takes longer, hot
            self.max_ns = time_ns
        units = time_ns >> 10 if time_ns > 0 else 0
        shift = units.bit_length() - _SUB_BITS - 1
        if shift > 0:
            units = (units >> shift) + (shift << _SUB_BITS)
        self._bins[units if units < _BINS else _BINS - 1] += 1
        self.count += 1

    def merge(self, other: Histogram) -> None:
        """Count all that another one counted too."""
        self._bins = [mine + theirs for mine, theirs in zip(self._bins, other._bins, strict=True)]
        self.count += other.count
        self.max_ns = max(self.max_ns, other.max_ns)

    def quantiles_us(self, fractions: Sequence[float]) -> list[float]:
        """The upper edges in µs of the bins of these fractions, ascending; zeros when nothing was added."""
        if not self.count:
            return [0.0] * len(fractions)
        found: list[float] = []
        seen = 0
        for index, count in enumerate(self._bins):
            seen += count
            while count and seen >= fractions[len(found)] * self.count:
                found.append(min(_upper_edge_ns(index), self.max_ns) / 1000.0)
                if len(found) == len(fractions):
                    return found
        return found

    @property
    def max_us(self) -> float:
        """The largest time in µs."""
        return self.max_ns / 1000.0


def _upper_edge_ns(index: int) -> int:
    shift = max((index >> _SUB_BITS) - 1, 0)
    return (index - (shift << _SUB_BITS) + 1 << shift) * _UNIT_NS
