"""Fits from several starts: a few iterations from each, and the most promising goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.joint_fit import JointFit
from mrctl.identify.processes import in_processes

Array = NDArray[np.float64]

HEAT, HEAT_TOLERANCE = 4, 1e-2  # iterations from each start, before the best goes on
TOLERANCE = 1e-4  # share of the cost that another step must win
LOST = 2  # iterations on all data, from where few data have shown that nothing comes of it
CLOSE = 0.7  # of the best fit's log-likelihood ratio, that another one's must come near


@dataclass(frozen=True)
class Heat:
    """Where a few iterations lead, its total cost, and what that may become should they go on as they did."""

    theta: Array
    total: float
    promised: float

    @classmethod
    def of(cls, fit: JointFit) -> Heat:
        """A fit that has come to an end promises no more."""
        more = 0.0 if fit.solution.converged else fit.solution.last_gain
        return cls(fit.theta, fit.total, fit.total - more)


def heats_of(heat: Callable[[Array], JointFit], starts: Sequence[Array]) -> list[Heat]:
    """A few iterations from each start, side by side."""
    return in_processes(lambda start: Heat.of(heat(start)), starts)


def heated_on(
    heat: Callable[[Array], JointFit], heats: Sequence[Heat], worth: Callable[[Heat], bool]
) -> list[Heat]:
    """A few iterations more of those that are worth it, the others as they were."""
    going = [k for k, one in enumerate(heats) if worth(one)]
    further = dict(zip(going, heats_of(heat, [heats[k].theta for k in going]), strict=True))
    return [further.get(k, one) for k, one in enumerate(heats)]


def near_cost(none: float, best: float) -> float:
    """The total cost above which a log-likelihood is not near the best fit's; none: that of no effect."""
    return float(none * min(best / none, 1.0) ** CLOSE)


def raced(
    starts: Sequence[Array],
    heat: Callable[..., JointFit],
    fitted: Callable[..., JointFit],
    cost: Callable[[Array], float],
    iterations: int,
    known: float = np.inf,
    more: int = 0,
    *,
    few: float | None = None,
) -> JointFit:
    """The fit from the start that a few iterations promise most of.

    heat, fitted: as `JointModel.fit`, the heats' on as much data as is enough to choose by; cost: on all
    data. Where the choice was wrong, and another place costs less than the fit, that is where it begins anew.
    known: as `pursued` has it. more: times that starts which may still become the best are heated on. few:
    where heats are on so few data that the best one goes on there first, to where it is not far from all
    data's: what is known there. One that ends above it is not gone on with on all data.
    """
    further = partial(heat, iterations=HEAT, tolerance=HEAT_TOLERANCE, passing=True)
    heats = _heated(starts, further, more)
    best = min(heats, key=lambda one: one.total)
    begin = best.theta
    if few is not None:
        ended = heat(begin, iterations=iterations, tolerance=TOLERANCE, passing=True, known=few)
        begin = min(begin, ended.theta, key=cost)
        if ended.total > few:  # from where it is no worse than without it, if from anywhere
            return fitted(min((*starts, begin), key=cost), iterations=LOST, tolerance=TOLERANCE)
    fit = pursued(fitted, begin, iterations, known)
    costs = [(cost(theta), theta) for theta in (*starts, *(one.theta for one in heats if one is not best))]
    least, there = min(costs, key=lambda one: one[0])
    if least >= cost(fit.theta):
        return fit
    other = pursued(fitted, there, iterations, known)
    return min(fit, other, key=lambda one: one.total)


def _heated(starts: Sequence[Array], heat: Callable[[Array], JointFit], more: int) -> list[Heat]:
    """A few iterations from each start, and more where as much gain again would make it the best one."""
    heats = heats_of(heat, starts)
    for _ in range(more):
        least = min(one.total for one in heats)
        heats = heated_on(heat, heats, partial(_may_reach, least))
    return heats


def _may_reach(total: float, one: Heat) -> bool:
    return one.promised < total


def pursued(fitted: Callable[..., JointFit], theta: Array, iterations: int, known: float) -> JointFit:
    """The fit from one start, ended early where it is not on its way to better a known total cost."""
    first = fitted(theta, iterations=HEAT, tolerance=TOLERANCE)
    more = iterations - HEAT
    if first.solution.converged or first.total - more * first.solution.last_gain > known:
        return first
    return fitted(first.theta, iterations=more, tolerance=TOLERANCE, known=known)
