"""Whether a later effect is one of its own, or a patch on the form of those found before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.proof import Proof
from mrctl.identify.joint_fit import JointFit

Array = NDArray[np.float64]

SILENT = 0.02  # of the RMS of what the effects found make of the force, ...
LEAST_SILENT = 0.1  # ... in this share of the samples


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """What a later effect takes off the mean square where the effects found are silent."""

    samples: float  # share of all that are silent
    to_all: float  # taken there, over what is taken on the whole
    of_left: float  # taken there, over what was left there


def elsewhere(before: Proof, after: Proof, found: set[str]) -> Elsewhere | None:
    """Whether a later effect acts where the effects found do not; None where they are hardly ever silent.

    A form that is not quite right leaves its error where the effect acts: what mends it takes nothing
    elsewhere (0 of what it takes on the whole). What has nothing to do with it takes as much there as
    anywhere (1), or more.
    """
    model = before.fit.model
    made = [model.weighed(r, f) for r, f in zip(model.records, forces_of(before.fit, found), strict=True)]
    parts = zip(made, _residuals(before), _residuals(after), strict=True)
    forces, old, new = (np.concatenate(x) for x in zip(*(_aligned(*p) for p in parts), strict=True))
    taken = old**2 - new**2
    size = np.abs(forces)
    silent = size <= SILENT * np.sqrt(np.mean(size**2))
    if silent.mean() < LEAST_SILENT:
        return None
    there = float(taken[silent].mean())
    return Elsewhere(
        float(silent.mean()),
        there / float(taken.mean()) if taken.mean() > 0.0 else 0.0,
        there / max(float(np.mean(old[silent] ** 2)), 1e-300),
    )


def forces_of(fit: JointFit, names: set[str]) -> list[Array]:
    """What these effects make of each record's force in N, every sample, tables and filter as they are."""
    rest = fit.less(names)
    both = zip(fit.model.predict(fit.theta), rest.model.predict(rest.theta), strict=True)
    return [whole - part for whole, part in both]


def _residuals(proof: Proof) -> list[Array]:
    return proof.fit.model.residuals(proof.fit.theta)


def _aligned(*parts: Array) -> tuple[Array, ...]:
    """The last samples that all have: starts of different length are left out of them."""
    n = min(p.size for p in parts)
    return tuple(p[p.size - n :] for p in parts)
