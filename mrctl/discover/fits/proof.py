"""The proof of a model: its error on data that its fit did not see, and how sure a gain is.

A fold is predicted by the fit of all data moved one damped Newton step towards the fit of the others: by
then the fold's own data have lost their say. This needs each fold's normal equations only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from mrctl.discover.fits.folds import labels
from mrctl.identify.base import Rows
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.noise import correlation_inflation
from mrctl.identify.penalties import total_weight
from mrctl.identify.solver import scaled_solution

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

OPEN = 1e-2  # of what all folds say of a parameter: where the others say less, it stays as it is
SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step that overshoots


@dataclass(frozen=True, eq=False)
class Proof:
    """A fit judged on all records: square sums in N² at the weighing rate, one by record and by fold."""

    fit: JointFit
    inside: Array  # (records,) square sum of the residual
    counts: Array  # (records,) samples
    colour: Array  # (records,) samples that count as one
    held_out: Array  # (folds,) square sum, each fold predicted from the others
    fold_counts: Array  # (folds,)

    @property
    def mean_square(self) -> float:
        """In sample, N²."""
        return float(self.inside.sum() / self.counts.sum())

    @property
    def held_out_mean_square(self) -> float:
        """On held-out data, N²."""
        return float(self.held_out.sum() / self.fold_counts.sum())

    def predicts_better_than(self, other: Proof) -> bool:
        """Whether held-out data speak for it: fold by fold in ratios, so that no wild fold decides alone."""
        ratios = np.log(np.maximum(self.held_out, 1e-300) / np.maximum(other.held_out, 1e-300))
        return float(self.fold_counts @ ratios) < 0.0

    @property
    def independent(self) -> float:
        """Samples that count, over all records."""
        return float(np.sum(self.counts / self.colour))


def prove(fit: JointFit, folds: Sequence[tuple[int, ...]]) -> Proof:
    """Judge a fit; `folds` as `folds_of` made them for its records.

    One whose slopes are beyond all numbers, as where a spring was taken to no length, foretells nothing.
    """
    model, size = fit.model, fit.model.size
    count = 1 + max(max(f) for f in folds)
    matrices, rights = np.zeros((count, size, size)), np.zeros((count, size))
    inside, counts, colour, where = [], [], [], []
    for weight, own, (rest, rows) in zip(model.weights, folds, model.jacobians(fit.theta), strict=True):
        label = labels(own, rest.size)
        for fold in sorted(set(own)):
            part = label == fold
            own_rows = Rows(rows.values[:, part], rows.index)
            own_rows.add_to(matrices[fold], rights[fold], rest[part], weight)
        inside.append(float(rest @ rest))
        counts.append(rest.size)
        colour.append(correlation_inflation(rest))
        where.append(label)
    held_out, fold_counts = np.zeros(count), np.zeros(count)
    whole = matrices.sum(axis=0) + total_weight(fit.penalties)
    lower, upper = model.bounds()
    known = bool(np.all(np.isfinite(whole)) and np.all(np.isfinite(rights)))
    misses = [] if known else _aligned([model.weighed(r, r.force_n) for r in model.records], where)
    for fold in range(count):
        if known:
            step = _step(whole - matrices[fold], np.diag(whole), rights[fold], fit)
            misses = _moved(fit, step, (lower, upper), where, fold)
        held_out[fold] = sum(float(np.sum(r[own == fold] ** 2)) for r, own in zip(misses, where, strict=True))
        fold_counts[fold] = sum(int(np.count_nonzero(own == fold)) for own in where)
    model.forget()  # a search keeps many proofs
    return Proof(
        fit, np.array(inside), np.array(counts, dtype=np.float64), np.array(colour), held_out, fold_counts
    )


def _step(rest: Array, whole: Array, right: Array, fit: JointFit) -> Array:
    """The Newton step away from what one fold says; `whole`: what all folds say of each parameter."""
    free = np.flatnonzero(~fit.solution.held)
    step = np.zeros(fit.theta.size)
    step[free] = -scaled_solution(rest[np.ix_(free, free)], right[free], OPEN, whole[free])
    return step


def _moved(
    fit: JointFit, step: Array, bounds: tuple[Array, Array], where: list[Ints], fold: int
) -> list[Array]:
    """Residuals after the step, shortened until the other folds are no worse off than before it."""
    model = fit.model
    best: tuple[float, list[Array]] | None = None
    for share in SHARES:
        theta = np.clip(fit.theta + share * step, *bounds)
        misses = _aligned(model.residuals(theta), where)
        cost = sum(
            0.5 * w * float(np.sum(r[own != fold] ** 2))
            for w, r, own in zip(model.weights, misses, where, strict=True)
        ) + sum(0.5 * p.weight * p.excess(theta) for p in fit.penalties)
        if best is None or cost < best[0]:
            best = cost, misses
        elif cost > best[0]:
            break
    if best is None:
        raise ValueError("there is no step to try")
    return best[1]


def _aligned(residuals: list[Array], where: list[Ints]) -> list[Array]:
    """Residuals with the same number of samples as the labels: the start left out may change by a few."""
    return [
        r[-own.size :] if r.size >= own.size else np.concatenate([np.zeros(own.size - r.size), r])
        for r, own in zip(residuals, where, strict=True)
    ]


def log_gain(before: Proof, after: Proof) -> float:
    """Twice the gain in log-likelihood from one model to a larger one.

    Each record has a noise of its own, and as many independent samples as its residual's colour leaves it.
    """
    n = np.minimum(before.counts, after.counts) / after.colour
    return float(np.sum(n * np.log(np.maximum(before.inside, 1e-300) / np.maximum(after.inside, 1e-300))))


def chance(gain: float, parameters: int) -> float:
    """The probability that parameters without meaning gain as much: chi square."""
    return float(chdtrc(max(parameters, 1), max(gain, 0.0)))
