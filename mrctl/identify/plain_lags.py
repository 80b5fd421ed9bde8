"""A model's vector with a filter that is little more than a lag: where a fit is begun anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import hysteresis
from mrctl.identify.joint import JointModel
from mrctl.model.filters import ORDER

Array = NDArray[np.float64]

PLAIN_LAG_HZ = 20.0
TWO_LAGS_S = 5e-3  # the delay of both together


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


def free_to_be_late(model: JointModel) -> JointModel:
    """The same model with a filter that may have zeros to the right, as a delay has."""
    free = replace(model, minimum_phase=False)
    free.weigh_as(model)
    return free


def with_late_split(model: JointModel, theta: Array) -> tuple[Array, float]:
    """The vector with a filter that is no longer late, and by how many seconds it was."""
    own, delay_s = hysteresis.split_late(theta[model.layout.parts["filter"]])
    changed = theta.copy()
    changed[model.layout.parts["filter"]] = own
    return changed, delay_s


def _with_filter(model: JointModel, theta: Array, own: Array) -> Array:
    """The vector with this filter of the usual order; as it is where the model's is of another."""
    changed = theta.copy()
    if model.layout.order == ORDER:
        changed[model.layout.parts["filter"]] = own
    return changed
