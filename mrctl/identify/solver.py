"""Bounded Levenberg-Marquardt on normal equations, so that memory does not grow with the data.

In a narrow valley that bends, steps along its slope are short. Where the caller can tell how the forces bend
along a step, the step follows (geodesic acceleration: Transtrum, Sethna, arXiv:1201.5885).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mrctl.identify.penalties import Penalty, total_weight

Array = NDArray[np.float64]


FULL_STEP = 1e-3  # damping up to which a step is as good as Newton's
PATIENCE = 2  # short steps in a row that win little
FIRST_FALLS = 4  # steps that may win much, wherever the fit is on its way to
BENT = 0.75  # second-order part of a step, over its first-order part: more, and it is no step to be trusted


@dataclass(frozen=True, slots=True)
class Normal:
    """Weighted normal equations at a point: J'WJ, J'W(y - F) and half the weighted square sum."""

    matrix: Array
    right: Array
    cost: float


@dataclass(frozen=True, slots=True)
class Solution:
    """Where the fit stopped, and how."""

    theta: Array
    normal: Normal
    iterations: int
    converged: bool
    held: NDArray[np.bool_]  # parameters at a bound or not free
    last_gain: float = 0.0  # the most that one of the last two steps took off the cost


def solve(
    normal: Callable[[Array], Normal],
    cost: Callable[[Array], float],
    theta: Array,
    lower: Array,
    upper: Array,
    penalties: Sequence[Penalty],
    *,
    free: NDArray[np.bool_] | None = None,
    iterations: int = 20,
    tolerance: float = 1e-4,
    share: float = 0.0,
    bend: Callable[[Array, Array], Array | None] = lambda _theta, _step: None,
    passing: bool = False,
    known: float = np.inf,
) -> Solution:
    """Minimise cost plus penalties within bounds; `tolerance` is the decrease, in cost units, worth a step.

    The cost is a negative log-likelihood, so a decrease of 1e-4 is far inside every interval.
    share: of the cost where it is, that a decrease has to be as well: a start from afar must not tell.
    bend: at the point of the last normal equations, J'W F'' for the forces' second derivative along a step;
    None where it is not known. passing: the fit goes on from where this one stops, if at all, so the normal
    equations there are not made; those of the point before stand for them. known: a total that others have
    come to: a fit that would not come below it if it went on as it did last ends, after a few steps.
    """
    free = np.ones(theta.size, dtype=bool) if free is None else free
    theta = np.clip(theta, lower, upper)
    stiff = total_weight(penalties)
    # A parameter that no data move here they may move beyond a kink: a step that its prior alone makes across
    # it fails, and all others' with it. Then it stays.
    alone = np.count_nonzero(np.broadcast_to(stiff, 2 * theta.shape), axis=1) <= 1

    def total(at: Array, data: float) -> float:
        return data + sum(0.5 * p.weight * p.excess(at) for p in penalties)

    system = normal(theta)
    here = total(theta, system.cost)
    damping = 1e-4
    converged = False
    small = done = 0
    held = ~free
    gain = last_gain = 0.0
    while done < iterations:
        done += 1
        gradient = -system.right + sum((p.weight * p.slope(theta) for p in penalties), np.zeros(theta.size))
        held = ~free | ((theta <= lower) & (gradient > 0)) | ((theta >= upper) & (gradient < 0))
        full = system.matrix + stiff
        unseen = ~held & alone & (np.diag(system.matrix) <= 0.0)
        still, step_taken = held, False
        for _ in range(12):
            valley = _Valley.of(full, still, damping)
            if valley is None:
                damping *= 10.0
                continue
            step = valley.along(valley.step(gradient), partial(bend, theta))
            trial = np.clip(theta + step, lower, upper)
            there = total(trial, cost(trial))
            if there < here:
                step_taken = True
                break
            if here - there > -tolerance and float(np.abs(step).max()) < 1e-7:
                break
            damping *= 8.0
            still = held | unseen
        if not step_taken:
            converged = True
            break
        least = max(tolerance, share * there)
        gain, before = here - there, gain
        last_gain = max(gain, before)
        theta, here = trial, there
        # A short step wins little wherever it is: only a full one that wins little is the end.
        small = small + 1 if gain < least else 0
        full_step = damping <= FULL_STEP
        damping = max(damping / 10.0, 1e-10)
        converged = bool(small) and (full_step or small >= PATIENCE)
        lost = done >= FIRST_FALLS and here - (iterations - done) * last_gain > known
        if not (passing and (converged or lost or done == iterations)):
            system = normal(theta)
        if converged or lost:
            break
    return Solution(theta, system, done, converged, held, last_gain)


@dataclass(frozen=True, slots=True)
class _Valley:
    """Damped normal equations over the parameters that move, factorised."""

    size: int
    move: NDArray[np.intp]
    scale: Array
    factor: tuple[Array, bool]

    @classmethod
    def of(cls, full: Array, held: NDArray[np.bool_], damping: float) -> _Valley | None:
        """None where they are singular: more damping is needed. Nor where slopes are beyond all numbers."""
        move = np.flatnonzero(~held)
        part = full[np.ix_(move, move)]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-30))
        scaled = part * np.outer(scale, scale)
        scaled[np.diag_indices_from(scaled)] += damping
        if not np.all(np.isfinite(scaled)):
            return None
        try:
            return cls(full.shape[0], move, scale, cho_factor(scaled))
        except np.linalg.LinAlgError:
            return None

    def step(self, gradient: Array) -> Array:
        """The step down a gradient."""
        step = np.zeros(self.size)
        step[self.move] = cho_solve(self.factor, -gradient[self.move] * self.scale) * self.scale
        return step

    def along(self, step: Array, bend: Callable[[Array], Array | None]) -> Array:
        """The step as the valley bends, where that is known and no more than a correction."""
        bent = bend(step)
        if bent is None:
            return step
        more = self.step(bent)
        return step + 0.5 * more if self._length(more) <= BENT * self._length(step) else step

    def _length(self, step: Array) -> float:
        """Each parameter in what it means to the data by itself."""
        return float(np.linalg.norm(step[self.move] / self.scale))


def scaled_solution(matrix: Array, right: Array, ridge: float, sizes: Array) -> Array:
    """The solution (p) of normal equations (p, p), each parameter in units of what the data say of it.

    ridge: added to the diagonal in those units, so that what no data decide stays; sizes (p): the diagonal
    that says how much that is. Raises LinAlgError where they are singular all the same.
    """
    scale = 1.0 / np.sqrt(np.maximum(sizes, 1e-30))
    scaled = matrix * np.outer(scale, scale)
    scaled[np.diag_indices_from(scaled)] += ridge
    return np.asarray(scale * cho_solve(cho_factor(scaled), scale * right), dtype=np.float64)


def covariance(system: Normal, penalties: Sequence[Penalty], held: NDArray[np.bool_]) -> Array:
    """Inverse of the penalised normal matrix over the moving parameters, 0 for those held."""
    move = np.flatnonzero(~held)
    part = (system.matrix + total_weight(penalties))[np.ix_(move, move)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-30))
    scaled = part * np.outer(scale, scale)
    inverse = np.linalg.pinv(scaled, rcond=1e-13, hermitian=True) * np.outer(scale, scale)
    result = np.zeros((held.size, held.size))
    result[np.ix_(move, move)] = inverse
    return result
