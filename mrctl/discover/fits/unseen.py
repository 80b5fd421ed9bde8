"""Whether effects help to predict motions that a fit has not seen.

What describes the motions at hand may mislead in others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.refit import error_on, fitted, one_more
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.processes import in_processes
from mrctl.identify.records import Record
from mrctl.model.effects.base import Effect, Vector

Array = NDArray[np.float64]
Free = Mapping[str, Sequence[bool]]

SAME_MOTION = 0.1  # relative, in RMS of velocity and of stroke
FEWEST_MOTIONS, MOST_PARTS = 3, 4


@dataclass(frozen=True, eq=False)
class Unseen:
    """A model fitted once without each part of a campaign's motions, and its error in N on that part."""

    training: list[list[Record]]
    left_out: list[list[Record]]  # as they were measured
    fits: list[JointFit]

    @classmethod
    def of(
        cls,
        records: Sequence[Record],
        measured: Sequence[Record],
        known: Sequence[Effect],
        values: Mapping[str, Vector],
        free: Free | None = None,
    ) -> Unseen | None:
        """The fits of the known effects; None where the campaign has too few motions to leave one out."""
        parts = motion_parts(measured)
        if parts is None:
            return None
        every = sorted(set(parts))
        training = [[r for r, p in zip(records, parts, strict=True) if p != k] for k in every]
        left_out = [[r for r, p in zip(measured, parts, strict=True) if p == k] for k in every]
        own = {e.name: values.get(e.name, e.typical) for e in known}
        common = [*known, *(r for part in training for r in part)]
        fits = in_processes(lambda part: fitted(part, known, own, free=free), training, common)
        return cls(training, left_out, fits)

    @cached_property
    def errors_n(self) -> Array:
        """RMS error of each part, predicted from the others."""
        return np.array([error_on(f, part) for f, part in zip(self.fits, self.left_out, strict=True)])

    def with_one_more(
        self, chosen: Sequence[Effect], values: Mapping[str, Vector], free: Free | None = None
    ) -> Unseen:
        """The same with one more effect, the last of the chosen."""
        both = list(zip(self.fits, self.training, strict=True))
        common = [*chosen, *(c for fit in self.fits for c in fit.model.common)]
        fits = in_processes(lambda one: one_more(*one, chosen, values, free), both, common)
        return Unseen(self.training, self.left_out, fits)

    def foretells_better_than(self, other: Unseen) -> bool:
        """Whether its errors are smaller: part by part in ratios, so that no wild part decides alone."""
        return float(np.mean(np.log(self.errors_n / other.errors_n))) < 0.0


def motion_parts(records: Sequence[Record]) -> list[int] | None:
    """For each record the part that its motion belongs to; None for too few motions.

    Runs of one motion stay together; more motions than parts go to them in turn, by speed.
    """
    found: list[Array] = []
    own: list[int] = []
    for record in records:
        stroke = record.displacement_m - np.mean(record.displacement_m)
        size = np.log([_rms(record.velocity_m_s), _rms(stroke)])
        near = [k for k, other in enumerate(found) if np.all(np.abs(other - size) < SAME_MOTION)]
        if not near:
            found.append(size)
        own.append(near[0] if near else len(found) - 1)
    if len(found) < FEWEST_MOTIONS:
        return None
    turn = np.argsort(np.argsort([size[0] for size in found])) % MOST_PARTS
    return [int(turn[k]) for k in own]


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2))) + 1e-12
