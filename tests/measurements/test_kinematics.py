from __future__ import annotations

import numpy as np
import pytest
from motions import sine
from scipy import signal

from mrctl.measurements.derivative import differentiate, noise_sigma
from mrctl.measurements.integral import cumulative_integral, integrate

CASES = [
    # frequency Hz, cycles, rate Hz: the paper's protocol, whole and cut cycles, slow, fast, few samples
    (2.387, 9.0, 2000),
    (2.387, 8.59, 2000),
    (1.0, 11.3, 1000),
    (0.1, 4.63, 200),
    (5.0, 11.25, 200),
    (12.0, 16.44, 1000),
    (0.5, 1.55, 500),
]


def error(estimate, truth):
    return float(np.sqrt(np.mean((estimate - truth) ** 2) / np.mean(truth**2)))


def noisy(signal_, share, seed=0):
    return signal_ + share * signal_.std() * np.random.default_rng(seed).standard_normal(len(signal_))


@pytest.mark.parametrize(("frequency", "cycles", "rate"), CASES)
def test_displacement_comes_back_from_a_noisy_velocity_with_an_offset(frequency, cycles, rate):
    motion = sine(frequency, cycles, rate)
    velocity = noisy(motion.v, 0.01) + 0.05 * motion.v.std()
    result = integrate(velocity, 1 / rate)
    assert "zero mean" in result.how
    samples_per_cycle = rate / frequency
    # What noise alone adds up to (a random walk along the run, less its line) sets the bound.
    walk = 0.01 * 2 * np.pi * np.sqrt(cycles / samples_per_cycle / 15)
    assert error(result.values, motion.x) < 2e-3 + 2.5 * walk


@pytest.mark.parametrize(("frequency", "cycles", "rate"), CASES)
def test_clean_kinematics_come_back_almost_exactly(frequency, cycles, rate):
    motion = sine(frequency, cycles, rate)
    assert error(integrate(motion.v, 1 / rate).values, motion.x) < 1e-3
    assert error(differentiate(motion.x, 1 / rate), motion.v) < 2e-3
    assert error(differentiate(motion.v, 1 / rate), motion.a) < 3e-3


@pytest.mark.parametrize("share", [0.002, 0.01, 0.03])
@pytest.mark.parametrize(("frequency", "cycles", "rate"), CASES)
def test_velocity_from_a_noisy_displacement_beats_plain_differences(frequency, cycles, rate, share):
    motion = sine(frequency, cycles, rate)
    measured = noisy(motion.x, share)
    plain = error(np.gradient(measured, 1 / rate), motion.v)
    smart = error(differentiate(measured, 1 / rate), motion.v)
    assert smart < 0.8 * plain
    assert smart < 3 * share or rate / frequency < 100


@pytest.mark.parametrize(("frequency", "cycles", "rate"), CASES)
def test_acceleration_from_a_displacement_is_usable_where_plain_differences_are_not(frequency, cycles, rate):
    motion = sine(frequency, cycles, rate)
    measured = noisy(motion.x, 0.005)
    plain = error(np.gradient(np.gradient(measured, 1 / rate), 1 / rate), motion.a)
    smart = error(differentiate(measured, 1 / rate, order=2), motion.a)
    assert smart < 0.1
    assert smart < plain


def test_derivatives_have_no_phase_shift():
    motion = sine(3.0, 12.2, 1000, third=0.0)
    estimate = differentiate(noisy(motion.x, 0.01), 1e-3)
    middle = slice(500, -500)
    lags = range(-10, 11)
    fits = [np.corrcoef(np.roll(estimate, -lag)[middle], motion.v[middle])[0, 1] for lag in lags]
    assert abs(lags[int(np.argmax(fits))]) <= 1


def test_ramps_at_the_ends_leave_no_drift():
    t = np.arange(20_000) / 1000
    envelope = np.clip(t, 0, 1) * np.clip(20 - t, 0, 1)
    x = 0.0127 * envelope * np.sin(2 * np.pi * 2.387 * t)
    velocity = np.gradient(x, 1e-3)
    assert error(integrate(velocity + 0.01, 1e-3).values, x) < 2e-3


@pytest.mark.parametrize(("cycles", "ends"), [(3, 1), (4, 1), (9, 1), (4, 2), (9, 2)])
def test_ramps_do_not_tilt_a_run_that_is_steady_for_two_cycles(cycles, ends):
    t = np.arange(int(cycles / 0.5 * 1000)) / 1000
    envelope = np.clip(t / 2, 0, 1) * (np.clip((t[-1] - t) / 1.5, 0, 1) if ends == 2 else 1.0)
    x = 0.01 * envelope * np.sin(np.pi * t)
    result = integrate(np.gradient(x, 1e-3) + 0.002, 1e-3)
    assert error(result.values, x) < 5e-3


@pytest.mark.parametrize(
    "shape",
    [
        lambda t: 0.01 * signal.sawtooth(2 * np.pi * 0.5 * t, 0.5),
        lambda t: 0.01 * (np.sin(4.4 * t) + 0.5 * np.sin(19.5 * t + 1) + 0.2 * np.sin(69 * t + 2)),
        lambda t: 0.01 * signal.chirp(t, 0.3, 20, 10),
    ],
    ids=["triangle", "three sines", "sweep"],
)
def test_motions_that_do_not_repeat_lie_about_zero_and_lose_a_constant_offset(shape):
    t = np.arange(20_000) / 1000
    x = shape(t)
    result = integrate(np.gradient(x, 1e-3) + 0.005, 1e-3)
    assert result.values.max() == pytest.approx(-result.values.min())
    difference = result.values - x
    assert np.std(difference) < 0.01 * np.std(x)


def test_a_single_stroke_is_not_mistaken_for_drift():
    t = np.arange(5000) / 1000
    x = 0.02 * np.clip((t - 1) / 2, 0, 1)
    result = integrate(np.gradient(x, 1e-3), 1e-3)
    assert "single stroke" in result.how
    assert abs(result.values[-1] - 0.02) < 1e-5


@pytest.mark.parametrize("cycles", [1.0, 1.5, 2.0])
def test_one_slow_cycle_or_two_are_not_mistaken_for_drift(cycles):
    t = np.arange(0.0, 4.0 * cycles, 0.002)
    x = 0.013 * np.clip(2.0 * t, 0.0, 1.0) * np.sin(2.0 * np.pi * 0.25 * t)
    result = integrate(np.gradient(x, 0.002), 0.002)
    assert np.ptp(result.values) == pytest.approx(np.ptp(x), rel=0.01)


def test_the_integral_is_exact_for_cubics():
    t = np.arange(50) * 0.1
    assert np.allclose(cumulative_integral(4 * t**3 - 2 * t, 0.1), t**4 - t**2, atol=1e-9)


def test_the_noise_of_a_smooth_signal_is_measured():
    motion = sine(rate=2000)
    assert noise_sigma(noisy(motion.v, 0.05)) == pytest.approx(0.05 * motion.v.std(), rel=0.1)
    assert noise_sigma(motion.v) < 1e-4 * motion.v.std()


@pytest.mark.parametrize("count", [10, 11, 20, 47])
def test_short_runs_have_kinematics_of_their_length(count):
    values = np.sin(np.arange(count))
    assert len(differentiate(values, 0.01)) == count
    assert len(differentiate(values, 0.01, order=2)) == count
    assert len(integrate(values, 0.01).values) == count


def test_still_channels_have_still_kinematics():
    assert not np.any(differentiate(np.full(100, 3.0), 0.01) > 1e-9)
    assert not np.any(integrate(np.zeros(100), 0.01).values)
