"""Courses that a force has for reasons of no effect in the library: what is left is held against each.

A force may fade as the damper works, its knee may lie elsewhere at another current, the stiffness of a rubber
may relax. None of these can be named and put into a calibration, but where one of them takes what a model
leaves, something is missing that is not in the model; and which one does so is where to look for it. Each is
a few columns of force; how much of the residual they take is known once the model, effects and all, may move
beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.special import fdtrc

from mrctl.discover.fits.proof import Proof, chance
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.verdict.course_kinds import KINDS, Kind
from mrctl.discover.verdict.course_signals import Column, Columns, Signals
from mrctl.discover.verdict.worth import LEAST_SCORE, SIGNIFICANCE
from mrctl.identify.parallel import in_parallel

Array = NDArray[np.float64]

SAME = 1e-6  # of a column's square: less of it is beyond the model, and it is the model's own
FEWEST_PARTS = 12  # of the data, that must agree on a course; records are cut where they are fewer
AGREED = 1e-4  # of what they say, by chance: true courses are far below, what only seems one hardly


@dataclass(frozen=True, slots=True)
class Course:
    """What one course takes of the mean square that a model leaves, and whether that is no chance."""

    words: str  # what a force of that course does
    share: float  # of the mean square in N²
    gain: float  # twice the log-likelihood ratio to the model without it
    score: float  # the gain less what its parameters must earn (BIC)
    chance: float  # that one without meaning takes as much, of all that were tried
    disagreement: float  # the chance of such a course in parts of the data that do not agree on it
    alike: frozenset[str] = frozenset()  # effects that it may be another form of
    measure: str = ""  # what would show it by itself

    @property
    def certain(self) -> bool:
        """Whether something of that course is left."""
        agreed = self.disagreement < AGREED
        return agreed and self.chance < SIGNIFICANCE and self.score > LEAST_SCORE


def courses_of(proof: Proof, colour: Array | None = None) -> list[Course]:
    """What each course takes of what a model leaves, the model settling beside it; most first.

    colour: samples that count as one in each record; None for those of what this model leaves.
    """
    fit = proof.fit
    signals = Signals(fit, fit.model.records, fit.model.predict(fit.theta))
    own = proof.colour if colour is None else colour
    left = _Left(Tangent.of(fit), proof.counts.astype(np.intp), proof.counts / own, fit.model.weights)
    found = in_parallel(lambda kind: _judged(left, signals, kind), KINDS)
    fit.model.forget()  # a search keeps many proofs
    tried = sum(sets for _, sets in found)
    courses = [replace(course, chance=min(1.0, course.chance * tried)) for course, _ in found]
    return sorted(courses, key=lambda c: -c.share)


def _judged(left: _Left, signals: Signals, kind: Kind) -> tuple[Course, int]:
    """A course with the set of columns that takes most, and how many sets there were."""
    found = [(left.taken(columns, kind.low), len(columns.own)) for columns in kind.make(signals)]
    taken, columns = max(found, key=lambda one: one[0].gain, default=(_Taken(), 1))
    parameters = columns + (len(found) > 1)
    score = taken.gain - parameters * float(np.log(left.independent.sum()))
    by_chance = chance(taken.gain, parameters)
    alike = frozenset(kind.alike)
    course = Course(
        kind.words, taken.share, taken.gain, score, by_chance, taken.disagreement, alike, kind.measure
    )
    return course, len(found)


@dataclass(frozen=True, slots=True)
class _Taken:
    """What a set of columns takes."""

    gain: float = 0.0
    share: float = 0.0
    disagreement: float = 1.0


@dataclass(frozen=True, eq=False)
class _Left:
    """What a model leaves: its tangent; of each record the samples, those that count, and its weight."""

    tangent: Tangent
    samples: NDArray[np.intp]
    independent: Array
    weights: Array

    def taken(self, columns: Columns, low: float) -> _Taken:
        """What columns of force, of sizes from `low` up, take off what those beside them leave."""
        before = self.tangent.residual
        own, beside = self._beyond(columns.own), self._beyond(columns.beside)
        if beside.size:
            both = np.vstack([own, before])
            both -= np.linalg.lstsq(beside.T, both.T, rcond=SAME)[0].T @ beside
            own, before = both[:-1], both[-1]
        own = own[np.sum(own**2, axis=1) > SAME]
        if not own.size:
            return _Taken()
        gram, right = own @ own.T, own @ before
        axes, spread, _ = np.linalg.svd(gram)
        root = axes * np.sqrt(np.maximum(spread, SAME * spread[0]))  # root root' is the gram
        sizes = lsq_linear(root.T, np.linalg.solve(root, right), (low, np.inf)).x
        used = np.abs(sizes) > SAME * np.max(np.abs(sizes), initial=0.0)
        if not used.any():
            return _Taken()
        after = before - sizes @ own
        was, left, whole = (self._of_records(x**2) for x in (before, after, self.tangent.residual))
        gain = float(self.independent @ np.log(np.maximum(was, 1e-300) / np.maximum(left, 1e-300)))
        share = float(np.sum((was - left) / self.weights) / np.sum(whole / self.weights))
        return _Taken(gain, share, self._disagreement(own[used], after, (gram @ sizes)[used]))

    def _beyond(self, columns: Sequence[Column]) -> Array:
        """Columns of unit length less what the model makes up for (columns, n)."""
        if not columns:
            return np.zeros((0, self.tangent.residual.size))
        rows = np.array([self.tangent.stacked(c) for c in columns])
        size = np.sqrt(np.sum(rows**2, axis=1))
        return self.tangent.beyond(rows / np.maximum(size, 1e-300)[:, None])

    def _of_records(self, values: Array) -> Array:
        """Sums over each record."""
        return np.add.reduceat(values, np.cumsum(self.samples) - self.samples)

    def _disagreement(self, own: Array, rest: Array, pull: Array) -> float:
        """The chance of so much, by how much the parts of the data differ in what they say (Wald's test).

        Neighbouring samples say the same, and so do a run's: each part is one witness, whatever its samples.
        """
        cuts = -(-FEWEST_PARTS // self.samples.size)
        ends = np.cumsum(self.samples)
        starts = np.concatenate(
            [np.linspace(e - n, e, cuts + 1)[:-1] for n, e in zip(self.samples, ends, strict=True)]
        )
        said = np.add.reduceat(own * rest, np.unique(starts.astype(np.intp)), axis=1)
        parts, columns = said.shape[1], said.shape[0]
        wald = float(pull @ np.linalg.lstsq(said @ said.T, pull, rcond=SAME)[0])
        ratio = wald * (parts - columns) / (columns * (parts - 1))
        return float(fdtrc(columns, parts - columns, ratio)) if parts > columns else 1.0
