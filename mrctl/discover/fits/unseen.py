"""Whether effects help to predict motions that a fit has not seen.

What describes the motions at hand may mislead in others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.refit import error_on, fitted
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.processes import in_processes
from mrctl.identify.records import Record

Array = NDArray[np.float64]
Free = Mapping[str, Sequence[bool]]

SAME_MOTION = 0.1  # relative, in RMS of velocity and of stroke
FEWEST_MOTIONS, MOST_PARTS = 3, 4


@dataclass(frozen=True, eq=False)
class Unseen:
    """The RMS errors in N on each part of a campaign's motions, of a model fitted to the others."""

    errors_n: Array

    @classmethod
    def of(
        cls, fit: JointFit, records: Sequence[Record], measured: Sequence[Record], free: Free | None = None
    ) -> Unseen | None:
        """Of a model, at whose fit those without a part begin: so none of them ends in another valley.

        records: to fit; measured: the same as they were measured, to predict. None where the campaign has too
        few motions to leave one out.
        """
        parts = motion_parts(measured)
        if parts is None:
            return None
        chosen = fit.model.effects.chosen

        def error_n(part: int) -> float:
            rest = [r for r, p in zip(records, parts, strict=True) if p != part]
            out = [r for r, p in zip(measured, parts, strict=True) if p == part]
            return error_on(fitted(rest, chosen, fit.effect_values, start=fit, free=free), out)

        return cls(np.array(in_processes(error_n, sorted(set(parts)))))

    @property
    def level(self) -> float:
        """The mean logarithm of the errors: in ratios, so that no wild part decides alone."""
        return float(np.mean(np.log(self.errors_n)))


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
