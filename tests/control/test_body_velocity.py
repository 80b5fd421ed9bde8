"""Body velocity from acceleration: no drift, and a stated error where the body moves."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from mrctl.control.body_velocity import BodyVelocityEstimator


def run(acceleration, cutoff_hz=0.1, dt_s=0.001):
    estimator = BodyVelocityEstimator(cutoff_hz, dt_s)
    return np.array([estimator.step(float(a)) for a in acceleration])


def test_biased_accelerometer_does_not_make_the_velocity_drift():
    velocity = run(np.full(120_000, 0.5))
    assert np.max(np.abs(velocity)) < 0.5 / (2.0 * math.pi * 0.1)  # a passing swing, below bias over cutoff
    assert np.max(np.abs(velocity[-1000:])) < 1e-9


def test_noise_stays_bounded_over_an_hour():
    noise = np.random.default_rng(1).normal(0.0, 0.3, 360_000)
    velocity = run(noise, dt_s=0.01)
    halves = np.std(velocity[:180_000]), np.std(velocity[180_000:])
    assert halves[1] == pytest.approx(halves[0], rel=0.2)


@pytest.mark.parametrize("dt_s", [0.0005, 0.001, 0.002])
@pytest.mark.parametrize("frequency_hz", [1.0, 2.0, 3.0])
def test_error_where_the_body_moves_is_what_is_stated_and_small(frequency_hz, dt_s):
    t = np.arange(0.0, 40.0, dt_s)
    true = np.sin(2.0 * math.pi * frequency_hz * t)
    found = run(2.0 * math.pi * frequency_hz * np.cos(2.0 * math.pi * frequency_hz * t), dt_s=dt_s)
    tail = t >= 30.0
    wave = np.exp(-2j * math.pi * frequency_hz * t[tail])
    ratio = np.sum(found[tail] * wave) / np.sum(true[tail] * wave)
    gain, lead_deg = BodyVelocityEstimator(0.1, dt_s).error(frequency_hz)
    assert abs(ratio) == pytest.approx(gain, abs=2e-3)
    assert math.degrees(cmath.phase(ratio)) == pytest.approx(lead_deg, abs=0.1)
    assert abs(gain - 1.0) < 1e-4
    assert 0.0 < lead_deg < 8.2 / frequency_hz


def test_reset_forgets():
    estimator = BodyVelocityEstimator(0.1, 0.001)
    for _ in range(100):
        estimator.step(3.0)
    estimator.reset()
    assert estimator.step(0.0) == 0.0


@pytest.mark.parametrize("cutoff_hz", [0.0, -1.0, math.nan, 60.0])
def test_useless_cutoff_is_refused_with_the_mend(cutoff_hz):
    with pytest.raises(ValueError, match="suits a car"):
        BodyVelocityEstimator(cutoff_hz, 0.001)
