"""What courses of force are made of, and the columns that they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.evidence import MOVED_M
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record

Array = NDArray[np.float64]
Column = list[Array]  # a force's course in each record, every sample
Level = Callable[[Record], Array]

SMALL = 0.01  # of the velocity, a step to see what a knee at another speed would change


@dataclass(frozen=True, eq=False)
class Signals:
    """What the courses are made of."""

    fit: JointFit
    records: Sequence[Record]
    forces: Column

    def each(self, make: Callable[..., Array], *more: float) -> Column:
        """What is made of each record and the model's force there (n), in N."""
        return [make(r, f, *more) for r, f in zip(self.records, self.forces, strict=True)]

    def change(self, level: Level) -> float:
        """How far a level goes in all records together."""
        return max(float(level(r).max()) for r in self.records) - min(
            float(level(r).min()) for r in self.records
        )

    def centred(self, level: Level) -> Column:
        """A level from its mean, over its largest distance from there: -1 to 1."""
        mean = float(np.mean(np.concatenate([level(r) for r in self.records])))
        most = max(float(np.max(np.abs(level(r) - mean))) for r in self.records)
        return [(level(r) - mean) / max(most, 1e-300) for r in self.records]

    def faster(self, share: Column) -> Column:
        """How the model's force would change, in N, by motions that are faster by that share."""
        moved = [
            replace(r, velocity_m_s=r.velocity_m_s * (1.0 + SMALL * x))
            for r, x in zip(self.records, share, strict=True)
        ]
        there = self.fit.model.on(moved).predict(self.fit.theta)
        return [(a - b) / SMALL for a, b in zip(there, self.forces, strict=True)]

    @property
    def moves(self) -> bool:
        """Whether there is a stroke."""
        return any(float(np.ptp(r.displacement_m)) > MOVED_M for r in self.records)


def product(one: Column, other: Column) -> Column:
    """Of two columns, sample by sample."""
    return [a * b for a, b in zip(one, other, strict=True)]


@dataclass(frozen=True, eq=False)
class Columns:
    """A course's columns of force, and those beside it that are something else's: no credit for these."""

    own: list[Column]
    beside: list[Column] = field(default_factory=list)
