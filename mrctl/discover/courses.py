"""Courses that a force has for reasons of no effect in the library: what is left is held against each.

A force may fade as the damper works, its knee may lie elsewhere at another current, the stiffness of a rubber
may relax. None of these can be named and put into a calibration, but where one of them takes what a model
leaves, something is missing that is not in the model; and which one does so is where to look for it. Each is
a few columns of force; how much of the residual they take is known once the model, effects and all, may move
beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from mrctl.discover.course_kinds import KINDS, Column, Kind, Signals
from mrctl.discover.proof import Proof, chance
from mrctl.discover.tangent import Tangent
from mrctl.discover.worth import LEAST_SCORE, SIGNIFICANCE
from mrctl.identify.parallel import in_parallel

Array = NDArray[np.float64]

SAME = 1e-6  # of a column's square: less of it is beyond the model, and it is the model's own


@dataclass(frozen=True, slots=True)
class Course:
    """What one course takes of the mean square that a model leaves, and whether that is no chance."""

    words: str  # what a force of that course does
    share: float
    score: float  # twice the log-likelihood ratio less what its parameters must earn (BIC)
    chance: float  # that a course without meaning takes as much, of all
    alike: frozenset[str]  # effects that it may be another form of
    measure: str = ""  # what would show it by itself

    @property
    def certain(self) -> bool:
        """Whether something of that course is left."""
        return self.chance < SIGNIFICANCE and self.score > LEAST_SCORE


def courses_of(proof: Proof) -> list[Course]:
    """What each course takes of what a model leaves, the model settling beside it; most first."""
    fit = proof.fit
    tangent = Tangent.of(fit)
    signals = Signals(fit, fit.model.records, fit.model.predict(fit.theta))
    whole, samples = float(tangent.residual @ tangent.residual), proof.independent
    if whole <= 0.0:
        return []

    def judged(kind: Kind) -> Course:
        found = [(_taken(tangent, columns, kind.low) / whole, len(columns)) for columns in kind.make(signals)]
        share, columns = max(found, default=(0.0, 1))
        parameters = columns + (len(found) > 1)
        gain = -samples * float(np.log1p(-min(share, 1.0 - 1e-12)))
        score = gain - parameters * float(np.log(samples))
        by_chance = min(1.0, chance(gain, parameters) * len(KINDS))
        return Course(kind.words, share, score, by_chance, frozenset(kind.alike), kind.measure)

    return sorted(in_parallel(judged, KINDS), key=lambda c: -c.share)


def _taken(tangent: Tangent, columns: Sequence[Column], low: float) -> float:
    """What columns of force, of sizes from `low` up, take off the weighed square sum."""
    rows = np.array([tangent.stacked(column) for column in columns])
    size = np.sqrt(np.sum(rows**2, axis=1))
    beyond = tangent.beyond(rows / np.maximum(size, 1e-300)[:, None])
    beyond = beyond[np.sum(beyond**2, axis=1) > SAME]
    if not beyond.size:
        return 0.0
    axes, spread, _ = np.linalg.svd(beyond @ beyond.T)
    root = axes * np.sqrt(np.maximum(spread, SAME * spread[0]))  # root root' is the columns' gram
    target = np.linalg.solve(root, beyond @ tangent.residual)
    return float(target @ target - 2.0 * lsq_linear(root.T, target, (low, np.inf)).cost)
