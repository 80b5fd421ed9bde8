"""Filters that a fit may begin with: how late they let a slow input come out."""

import numpy as np
import pytest
from scipy.signal import lfilter

from mrctl.identify import filtering, hysteresis

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


def test_a_late_filter_is_one_that_is_not_behind_a_delay():
    late = np.array([-1.15, 1.02, 3.15, 0.91, 0.89, -0.05])  # a zero to the right of the axis
    own, delay_s = hysteresis.split_late(late)
    assert delay_s > 1e-4
    assert np.all(own[3:] > 0.0)
    t = np.arange(4000) / 2000.0
    u = np.sin(2.0 * np.pi * 6.0 * t) + 0.3 * np.sin(2.0 * np.pi * 17.0 * t)
    starts = np.array([0, t.size])
    one = filtering.filtered(*hysteresis.discretise(late, 2000.0), u, starts)
    other = filtering.filtered(*hysteresis.discretise(own, 2000.0), u, starts)
    behind = np.interp(t - delay_s, t, other)
    settled = slice(1000, None)
    assert np.max(np.abs(one - behind)[settled]) < 1e-3 < np.max(np.abs(one - other)[settled])


def test_a_filter_that_is_not_late_stays_as_it_is():
    plain = hysteresis.lag(20.0)
    own, delay_s = hysteresis.split_late(plain)
    assert delay_s == 0.0
    assert own == pytest.approx(plain, rel=1e-9)
