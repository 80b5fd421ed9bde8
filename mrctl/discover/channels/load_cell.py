"""What a load cell adds to the force of each run: its zero, and its scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.records import Record

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoadCell:
    """A force measured as (1 + gain) F + zero, one of each in every run."""

    zeros_n: Array
    gains: Array

    @classmethod
    def true(cls, runs: int) -> LoadCell:
        """One that adds nothing."""
        return cls(np.zeros(runs), np.zeros(runs))

    def same_as(self, other: LoadCell) -> bool:
        """Whether it measures alike."""
        return np.array_equal(self.zeros_n, other.zeros_n) and np.array_equal(self.gains, other.gains)

    def with_gains(self, more: Array) -> LoadCell:
        """One whose runs are measured larger by such shares (runs) of what this one leaves."""
        return replace(self, gains=(1.0 + self.gains) * (1.0 + more) - 1.0)

    def instead_of(self, taken: LoadCell, records: Sequence[Record]) -> list[Record]:
        """The records, this taken off their forces where the other had been."""
        scales = (1.0 + taken.gains) / (1.0 + self.gains)
        shifts = (taken.zeros_n - self.zeros_n) / (1.0 + self.gains)
        each = zip(records, scales, shifts, strict=True)
        return [replace(r, force_n=r.force_n * scale + shift) for r, scale, shift in each]
