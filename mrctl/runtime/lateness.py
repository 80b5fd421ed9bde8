"""Percentiles of how late ticks woke, at a cost per tick that does not depend on how many there were."""

from __future__ import annotations

_BINS = 256
_BIN_NS = 4000  # fine bins up to 1 ms; what is later shows in the maximum


class Lateness:
    """A histogram of lateness since the last `clear`."""

    __slots__ = ("_bins", "_count", "_max_ns")

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._bins = [0] * _BINS
        self._count = 0
        self._max_ns = 0

    def add(self, late_ns: int) -> None:
        """One tick woke late_ns after it was due (negative: early, counted as 0)."""
        late_ns = max(late_ns, 0)
        self._bins[min(late_ns // _BIN_NS, _BINS - 1)] += 1
        self._count += 1
        self._max_ns = max(self._max_ns, late_ns)

    def percentiles_us(self) -> tuple[float, float, float]:
        """Median, 99th percentile (upper bin edges) and maximum, in µs; zeros when nothing was added."""
        return self._quantile_us(0.5), self._quantile_us(0.99), self._max_ns / 1000.0

    def _quantile_us(self, fraction: float) -> float:
        wanted, seen = fraction * self._count, 0
        for index, count in enumerate(self._bins):
            seen += count
            if seen >= wanted and count:
                return min((index + 1) * _BIN_NS, self._max_ns) / 1000.0
        return 0.0
