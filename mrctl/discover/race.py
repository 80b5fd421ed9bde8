"""Fits from several starts: a few iterations from each, and the most promising goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import hysteresis
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.model.filters import ORDER

Array = NDArray[np.float64]

HEAT, HEAT_TOLERANCE = 4, 1e-2  # iterations from each start, before the best goes on
TOLERANCE = 1e-4  # share of the cost that another step must win
PLAIN_LAG_HZ = 20.0
TWO_LAGS_S = 5e-3  # the delay of both together


def raced(
    starts: Sequence[Array],
    heat: Callable[..., JointFit],
    fitted: Callable[..., JointFit],
    cost: Callable[[Array], float],
    iterations: int,
) -> JointFit:
    """The fit from the start that a few iterations promise most of.

    heat, fitted: as `JointModel.fit`, the heats' on as much data as is enough to choose by; cost: on all
    data. Where the choice was wrong, and another place costs less than the fit, that is where it begins anew.
    """
    heats = [heat(one, iterations=HEAT, tolerance=HEAT_TOLERANCE) for one in starts]
    best = min(heats, key=lambda heat: heat.total)
    fit = fitted(best.theta, iterations=iterations, tolerance=TOLERANCE)
    costs = [(cost(theta), theta) for theta in (*starts, *(one.theta for one in heats if one is not best))]
    least, there = min(costs, key=lambda one: one[0])
    if least >= cost(fit.theta):
        return fit
    other = fitted(there, iterations=iterations, tolerance=TOLERANCE)
    return min(fit, other, key=lambda one: one.total)


def with_plain_lag(model: JointModel, theta: Array) -> Array:
    """The same vector with a plain lag for its filter.

    To make up for what is missing, a filter may have gone so far from where it belongs that no small step
    leads back.
    """
    return _with_filter(model, theta, hysteresis.lag(PLAIN_LAG_HZ))


def with_lag_of_two(model: JointModel, theta: Array) -> Array:
    """The same vector with two equal lags for its filter.

    A plain lag and a sensor's delay are nearly two lags; from the one no small step leads to the other.
    """
    return _with_filter(model, theta, hysteresis.lag_of_two(TWO_LAGS_S))


def _with_filter(model: JointModel, theta: Array, own: Array) -> Array:
    """The vector with this filter of the usual order; as it is where the model's is of another."""
    changed = theta.copy()
    if model.layout.order == ORDER:
        changed[model.layout.parts["filter"]] = own
    return changed
