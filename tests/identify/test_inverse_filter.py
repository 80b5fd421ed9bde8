"""The inverse filter follows in the band for every kind of forward filter, and rings at no loop rate."""

import numpy as np
import pytest
from scipy.signal import bilinear

from mrctl.identify.inverse_filter import LOOP_RATES_HZ, Shaping, design_inverse_filter
from mrctl.model.filters import Filter

RATE_HZ = 1200.0
BAND_HZ = np.linspace(0.25, 20.0, 80)


def second_order(hz, damping):
    w = 2.0 * np.pi * hz
    return [1.0], [1.0 / w**2, 2.0 * damping / w, 1.0]


FORWARD = {
    "none": ([1.0], [1.0]),
    "lag at 30 Hz": ([1.0], [1.0 / (2 * np.pi * 30.0), 1.0]),
    "lag at 8 Hz": ([1.0], [1.0 / (2 * np.pi * 8.0), 1.0]),
    "lead and lag": ([0.004, 1.0], [0.009, 1.0]),
    "second order at 45 Hz": second_order(45.0, 1.05),
    "second order at 70 Hz": second_order(70.0, 0.5),
}


def forward(name):
    numerator, denominator = FORWARD[name]
    b, a = bilinear(numerator, denominator, RATE_HZ) if len(denominator) > 1 else (numerator, denominator)
    return Filter.of(RATE_HZ, np.pad(b, (0, 4 - len(b))), np.pad(a, (0, 4 - len(a))))


@pytest.mark.parametrize("name", FORWARD)
def test_the_cascade_is_flat_in_the_band_at_every_loop_rate(name):
    h = forward(name)
    inverse = design_inverse_filter(h)
    for rate in LOOP_RATES_HZ:
        there = inverse.resampled(rate)
        assert np.max(np.abs(there.response(BAND_HZ) * h.response(BAND_HZ) - 1.0)) < 0.02


@pytest.mark.parametrize("name", FORWARD)
def test_it_amplifies_nothing_much_more_than_undoing_the_forward_filter_takes(name):
    h = forward(name)
    inverse = design_inverse_filter(h)
    for rate in LOOP_RATES_HZ:
        hz = np.linspace(0.1, 0.5 * rate, 20000)
        most = np.max(np.abs(inverse.resampled(rate).response(hz)))
        undone = np.max(1.0 / np.abs(h.response(np.linspace(0.1, 200.0, 2000))))
        assert most < 4.0 * undone


def test_a_late_filter_is_followed_where_it_can_be():
    # Zeros beyond the unit circle near 73 Hz: no stable filter follows there, and one that is asked to gets
    # worse below.
    b = (0.50646, -1.463377, 1.524438, -0.563274)
    a = (1.0, -2.507533, 2.151194, -0.639414)
    late = Filter.of(1000.0, np.array(b) * (np.sum(a) / np.sum(b)), a)
    assert np.max(np.abs(np.roots(b))) > 1.05
    inverse = design_inverse_filter(late)
    for hz, most in ((BAND_HZ, 0.004), (np.linspace(20.0, 40.0, 40), 0.2)):
        assert np.max(np.abs(inverse.response(hz) * late.response(hz) - 1.0)) < most


def test_a_soft_filter_that_a_slow_loop_barely_carries_is_followed_above_the_band_too():
    # An inverse for a slower or narrower band, taken in its place, doubles what is asked at 50 Hz.
    b, a = np.array((0.0051, 0.0022, 0.0159, -0.0031)), (1.0, -2.2952, 1.7724, -0.4571)
    soft = Filter.of(1000.0, b * (np.sum(a) / np.sum(b)), a)
    inverse = design_inverse_filter(soft)
    above = np.linspace(20.0, 50.0, 40)
    for rate in LOOP_RATES_HZ:
        there = inverse.resampled(rate)
        assert np.max(np.abs(there.response(BAND_HZ) * soft.response(BAND_HZ) - 1.0)) < 0.015
        assert np.max(np.abs(there.response(above) * soft.response(above) - 1.0)) < 0.6


def test_the_slopes_are_those_of_the_errors():
    shaping = Shaping(forward("second order at 45 Hz"), 100.0, 30.0)
    theta = np.array([1.0, 0.5, 2.0, 0.3, 0.2, 0.1])
    steps = 1e-5 * np.eye(theta.size)
    measured = [(shaping.errors(theta + step) - shaping.errors(theta - step)) / 2e-5 for step in steps]
    found = shaping.slopes(theta).T
    assert found == pytest.approx(np.array(measured), abs=1e-5 * np.abs(found).max())
