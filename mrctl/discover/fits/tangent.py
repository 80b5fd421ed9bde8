"""What the model in hand cannot absorb: directions of force orthogonal to its own slopes.

A candidate effect is scored only by this part. The model's slopes are taken once, at its fit; smoothness
penalties count as data, so that a table is as free as its fit left it and no freer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE
from mrctl.discover.fits.sample import as_all_say, has_long, remembers_long, sampled
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import total_weight
from mrctl.model.effects.base import Effect

Array = NDArray[np.float64]

RIDGE = 1e-10  # of each parameter's own information: keeps the factorisation alive, decides nothing


@dataclass(frozen=True, eq=False)
class Tangent:
    """The slopes of a fitted model over all records, weighed and stacked, and what is orthogonal to them.

    `residual` (n) is what the fit leaves, in units of each record's noise. `skips` (blocks left out at each
    record's start) and the weights are those of the fit, so that all vectors made by `stacked` compare.
    """

    fit: JointFit
    residual: Array
    skips: tuple[int, ...]
    slopes: Array  # (parameters that move, n)
    factor: tuple[Array, bool]
    lower: Array  # how far each moving parameter may go
    upper: Array
    frozen: bool = False
    partial: bool = False  # of some of the records only, at the fit of all

    def few(self, beside: Effect) -> JointModel:
        """The model on as much data as is enough to choose by, when that effect may come to it."""
        return self._pieces if self._forgets(beside) else self._whole

    def glance(self, beside: Effect) -> Tangent:
        """The tangent on that much data; itself where that is all."""
        return self._pieces_glance if self._forgets(beside) else self._whole_glance

    @cached_property
    def left_alone(self) -> float:
        """What the model leaves after a few more steps to the tangent's records, as a fit's total cost."""
        fit = self.fit
        hold = [as_all_say(fit, fit.theta)] if self.partial else []
        return fit.model.fit(
            fit.theta,
            penalties=[*fit.penalties, *hold],
            rounds=1,
            free=fit.moving,
            iterations=HEAT,
            tolerance=HEAT_TOLERANCE,
            passing=True,
        ).total

    def _forgets(self, beside: Effect) -> bool:
        """Whether a long record may be cut: nothing in the model remembers as long."""
        chosen = self.fit.model.effects.chosen
        return has_long(self.fit.model) and not remembers_long((*chosen, beside))

    @cached_property
    def _whole(self) -> JointModel:
        return sampled(self.fit.model, self.fit.theta, whole=True)

    @cached_property
    def _pieces(self) -> JointModel:
        return sampled(self.fit.model, self.fit.theta)

    @cached_property
    def _whole_glance(self) -> Tangent:
        return self._on(self._whole)

    @cached_property
    def _pieces_glance(self) -> Tangent:
        return self._on(self._pieces)

    def _on(self, few: JointModel) -> Tangent:
        if few is self.fit.model:
            return self
        return replace(Tangent.of(replace(self.fit, model=few), frozen=self.frozen), partial=True)

    @classmethod
    def of(cls, fit: JointFit, *, frozen: bool = False) -> Tangent:
        """The tangent at a fit; frozen: nothing moves, all of a force is beyond the model."""
        model, theta = fit.model, fit.theta
        free = np.zeros(theta.size, dtype=bool) if frozen else ~fit.solution.held
        rows, rests, skips = [], [], []
        for weight, record, (rest, line) in zip(
            model.weights, model.records, model.jacobians(theta), strict=True
        ):
            full = np.zeros((model.size, rest.size))
            full[line.index] = np.sqrt(weight) * line.values
            rows.append(full[free])
            rests.append(np.sqrt(weight) * rest)
            skips.append(model.settle_blocks(theta, record))
        slopes = np.concatenate(rows, axis=1)
        gram = slopes @ slopes.T + total_weight(fit.penalties)[np.ix_(free, free)]
        gram[np.diag_indices_from(gram)] += RIDGE * np.maximum(np.diag(gram), 1e-30)
        if frozen:
            gram = np.ones((1, 1))
            slopes = np.zeros((1, slopes.shape[1]))
        lower, upper = model.bounds()
        return cls(
            fit,
            np.concatenate(rests),
            tuple(skips),
            slopes,
            cho_factor(gram),
            (lower - theta)[free],
            (upper - theta)[free],
            frozen,
        )

    def stacked(self, forces: list[Array]) -> Array:
        """Forces of each record in N, every sample, as one vector (n) in units of the noise."""
        return np.concatenate(self.blocks(forces))

    def blocks(self, forces: Sequence[Array]) -> list[Array]:
        """The parts of that vector, one for each record."""
        model = self.fit.model
        return [
            np.sqrt(w) * model.weighed(r, f)[skip:]
            for w, f, r, skip in zip(model.weights, forces, model.records, self.skips, strict=True)
        ]

    def beyond(self, rows: Array) -> Array:
        """The part of rows (..., n) that the model's own parameters cannot make up for."""
        if self.frozen:
            return rows
        moved = cho_solve(self.factor, self.slopes @ rows.T)
        return np.asarray(rows - moved.T @ self.slopes, dtype=np.float64)

    def products_beyond(self, rows: Array) -> Array:
        """Rows (k, n) times their parts beyond the model: (k, k), without these being made."""
        whole = np.asarray(rows @ rows.T, dtype=np.float64)
        return whole if self.frozen else whole - self.absorbed(self.slopes @ rows.T)

    def absorbed(self, along: Array) -> Array:
        """What the model takes up of rows' products, given theirs with its slopes (m, k): (k, k)."""
        return np.asarray(along.T @ self.answer(along), dtype=np.float64)

    def answer(self, along: Array) -> Array:
        """How the moving parameters make up for rows, given their products with the slopes (m, ...)."""
        return np.asarray(cho_solve(self.factor, along), dtype=np.float64)

    def moved(self, force: Array) -> Array:
        """The fit's vector after the model has settled around a force (n) beside it."""
        if self.frozen:
            return self.fit.theta
        step = np.clip(-cho_solve(self.factor, self.slopes @ force), self.lower, self.upper)
        theta = self.fit.theta.copy()
        theta[~self.fit.solution.held] += step
        return theta
