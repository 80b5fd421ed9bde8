"""Signals between their samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from mrctl.measurements.refine import refined, refinement, straight


@pytest.mark.parametrize(
    ("rate_hz", "least_hz", "times"),
    [(200.0, 1000.0, 5), (300.0, 1000.0, 4), (1000.0, 1000.0, 1), (2e3, 1e3, 1)],
)
def test_a_rate_is_reached_by_whole_multiples(rate_hz, least_hz, times):
    assert refinement(rate_hz, least_hz) == times


def test_samples_stay_and_a_sine_between_them_is_one():
    t = np.arange(200) / 100.0
    sine = np.sin(2.0 * np.pi * 5.0 * t)
    fine = refined(sine, 4)
    assert fine.size == 199 * 4 + 1
    np.testing.assert_allclose(fine[::4], sine, atol=1e-12)
    truth = np.sin(2.0 * np.pi * 5.0 * np.arange(fine.size) / 400.0)
    assert np.max(np.abs(fine - truth)[40:-40]) < 2e-4


def test_it_is_the_spline_that_everybody_uses():
    x = np.random.default_rng(3).normal(size=300)
    fine = CubicSpline(np.arange(300.0), x)(np.arange(299 * 5 + 1) / 5.0)
    np.testing.assert_allclose(refined(x, 5)[100:-100], fine[100:-100], atol=1e-8)  # ends are bent otherwise


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_short_signals_and_parabolas(n):
    parabola = np.arange(float(n)) ** 2
    fine = refined(parabola, 3)
    assert fine[::3] == pytest.approx(parabola)
    if n >= 4:
        assert fine == pytest.approx((np.arange(fine.size) / 3.0) ** 2)


def test_what_steps_goes_straight():
    np.testing.assert_array_equal(straight(np.array([0.0, 1.0, 1.0]), 2), [0.0, 0.5, 1.0, 1.0, 1.0])
