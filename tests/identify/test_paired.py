"""Which two of three real poles share the quadratic factor: the same filter, and a way on for the fit."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mrctl.identify import hysteresis

NUMERATOR = [0.9, 0.8, 0.3]


def parameters(alone: float, one: float, other: float) -> np.ndarray:
    return np.array([*np.log([alone, one * other / (one + other), one * other]), *NUMERATOR])


@pytest.mark.parametrize("alone", [0.37, 4.1, 4.2])
def test_of_three_real_poles_the_nearest_two_become_the_pair(alone: float) -> None:
    poles = [0.37, 4.1, 4.2]
    theta = parameters(alone, *(p for p in poles if p != alone))
    assert_allclose(hysteresis.paired(theta), parameters(0.37, 4.1, 4.2), atol=1e-9)
    f = np.geomspace(0.1, 200.0, 50)
    assert_allclose(
        hysteresis.response(hysteresis.paired(theta), f), hysteresis.response(theta, f), rtol=1e-9
    )


def test_the_slow_two_are_a_pair_when_they_are_nearer() -> None:
    assert_allclose(hysteresis.paired(parameters(1.0, 1.2, 9.0)), parameters(9.0, 1.0, 1.2), atol=1e-9)


def test_a_complex_pair_and_other_orders_stay_as_they_are() -> None:
    pair = np.array([*np.log([0.3, 7.4, 21.9]), *NUMERATOR])
    assert hysteresis.paired(pair) is pair
    short = np.array([0.1, 0.9])
    assert hysteresis.paired(short) is short
