"""Filters that a fit may begin with: how late they let a slow input come out."""

import numpy as np
import pytest
from scipy.signal import lfilter

from mrctl.identify import hysteresis

RATE_HZ = 2000.0


@pytest.mark.parametrize(
    ("theta", "delay_s"),
    [
        (hysteresis.lag(20.0), 1.0 / (2.0 * np.pi * 20.0)),
        (hysteresis.lag_of_two(3e-3), 3e-3),
        (hysteresis.lag_of_two(0.02), 0.02),
    ],
)
def test_a_ramp_comes_out_as_late_as_the_lag_says(theta, delay_s):
    b, a = hysteresis.discretise(theta, RATE_HZ)
    t = np.arange(4000) / RATE_HZ
    late = t - lfilter(b, a, t)
    beside = 2.0 / hysteresis.LAG_PAIR_RAD_S  # the poles that are out of the way
    assert late[-1] == pytest.approx(delay_s, abs=beside, rel=0.15)


def test_two_lags_are_no_single_one():
    """At the start of a step two lags hardly move, where one moves at once."""
    step = np.ones(40)
    one, two = (
        lfilter(*hysteresis.discretise(theta, RATE_HZ), step)
        for theta in (hysteresis.lag(1.0 / (2.0 * np.pi * 5e-3)), hysteresis.lag_of_two(5e-3))
    )
    assert two[1] < 0.6 * one[1]
    assert two[-1] > 0.95
