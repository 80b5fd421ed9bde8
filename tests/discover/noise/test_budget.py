"""How much of what a fit leaves is noise: noise of several colours is, and what comes and goes is not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from mrctl.discover.noise.budget import UNSEEN_DOUBT, Budget, budget_of
from mrctl.discover.noise.noise_floor import NoiseFloor
from mrctl.discover.noise.spectral_floor import spectral_floor

RATE_HZ, RUNS, N = 1000.0, 10, 4000


def coloured(rng, remembers, size_n):
    """Noise that remembers so much of its last sample, of that RMS."""
    drawn = lfilter([np.sqrt(1.0 - remembers**2)], [1.0, -remembers], rng.standard_normal(N + 500))
    return size_n * drawn[500:]


def floor_of(error):
    """What a run that does not repeat shows of its noise: from sample to sample."""
    least = float(np.sqrt(np.mean(np.diff(error, n=3) ** 2) / 20.0))
    return NoiseFloor(None, "lower bound only", least)


def left(errors, floors=None):
    brought = [np.zeros(e.size) for e in errors]
    return budget_of(errors, brought, floors or [floor_of(e) for e in errors], [RATE_HZ] * len(errors))


@pytest.mark.parametrize(
    ("remembers", "size_n", "white_n"),
    [(0.0, 10.0, 0.0), (0.9, 10.0, 0.0), (0.9, 12.0, 6.0)],
)
def test_noise_is_recognised_whether_white_or_coloured_or_both(remembers, size_n, white_n):
    rng = np.random.default_rng(1)
    errors = [coloured(rng, remembers, size_n) + white_n * rng.standard_normal(N) for _ in range(RUNS)]
    found = spectral_floor(errors, [RATE_HZ] * RUNS, [np.zeros(N)] * RUNS)
    assert found is not None
    assert found.noise_n == pytest.approx(np.hypot(size_n, white_n), rel=0.15)
    assert left(errors).excess == 0.0


def test_noise_with_its_power_below_thirty_hertz_is_not_taken_for_something_else():
    rng = np.random.default_rng(5)
    errors = [coloured(rng, 0.96, 10.0) + 4.0 * rng.standard_normal(N) for _ in range(RUNS)]
    assert left(errors).excess == 0.0


def test_what_a_run_leaves_that_is_sampled_too_slowly_for_its_motion_says_nothing():
    """Its force jumps from sample to sample by more than is left of it."""
    rng = np.random.default_rng(7)
    errors = [coloured(rng, 0.8, 8.0) for _ in range(RUNS)]
    errors[3] = coloured(rng, 0.8, 60.0)
    floors = [floor_of(e) for e in errors]
    assert left(errors, floors).excess > 100.0
    floors[3] = NoiseFloor(None, "lower bound only", 80.0)
    assert left(errors, floors).excess == 0.0
    too_slow = [NoiseFloor(None, "lower bound only", 80.0)] * RUNS  # but where all are, they must speak
    assert left(errors, too_slow).judged == left(errors, too_slow).total


def test_what_some_runs_leave_and_others_do_not_is_no_noise():
    rng = np.random.default_rng(2)
    errors = [coloured(rng, 0.97, 60.0 if k % 2 else 2.0) + 5.0 * rng.standard_normal(N) for k in range(RUNS)]
    assert left(errors).excess > 0.5 * np.mean(np.concatenate(errors) ** 2)


def test_what_one_run_leaves_and_no_other_is_no_noise_though_all_together_leave_little():
    rng = np.random.default_rng(6)
    errors = [coloured(rng, 0.8, 3.0) + 2.0 * rng.standard_normal(N) for _ in range(RUNS)]
    assert left(errors).excess == 0.0
    errors[3] = errors[3] + coloured(rng, 0.97, 10.0)
    assert left(errors).excess == pytest.approx(10.0**2 / RUNS, rel=0.6)


def test_runs_whose_fast_motion_nearly_hides_their_noise_do_not_make_the_others_loud():
    rng = np.random.default_rng(8)
    errors = [coloured(rng, 0.9, 6.0) for _ in range(RUNS)]
    floors = [NoiseFloor(None, "lower bound only", 5.0 if k < 4 else 1.5) for k in range(RUNS)]
    assert left(errors, floors).certain == 0.0


def test_slow_samples_of_fast_runs_do_not_make_the_others_loud():
    rng = np.random.default_rng(7)
    errors = [coloured(rng, 0.6, 5.0) for _ in range(RUNS)]
    floors = [floor_of(e) for e in errors]
    for fast in (1, 4, 7):  # from sample to sample their force changes by far more than the noise does
        floors[fast] = NoiseFloor(None, "lower bound only", 80.0)
    assert left(errors, floors).certain == 0.0


def test_outbursts_are_no_noise():
    rng = np.random.default_rng(3)
    errors = [5.0 * rng.standard_normal(N) for _ in range(RUNS)]
    for error in errors:
        for at in rng.integers(0, N - 20, 20):
            error[at : at + 20] += rng.choice([-1.0, 1.0]) * 60.0 * np.hanning(20)
    assert left(errors).excess > 0.3 * np.mean(np.concatenate(errors) ** 2)


def test_runs_that_repeat_are_held_against_their_own_noise_though_they_are_few():
    rng = np.random.default_rng(4)
    errors = [coloured(rng, 0.9, 30.0) for _ in range(RUNS)]
    floors = [floor_of(e) for e in errors]
    assert left(errors, floors).excess == 0.0
    floors[0] = NoiseFloor(10.0, "cycles", floors[0].lower_bound_n, cycles=8)
    assert left(errors, floors).excess == pytest.approx(30.0**2 - 10.0**2, rel=0.3)
    floors[0] = NoiseFloor(28.0, "cycles", floors[0].lower_bound_n, cycles=8)
    assert left(errors, floors).excess == 0.0


def test_what_the_few_that_repeat_leave_counts_for_them_where_the_others_leave_less():
    rng = np.random.default_rng(4)
    errors = [coloured(rng, 0.9, 30.0 if k == 0 else 12.0) for k in range(RUNS)]
    floors = [floor_of(e) for e in errors]
    floors[0] = NoiseFloor(15.0, "cycles", floors[0].lower_bound_n, cycles=8)
    own = float(np.mean(errors[0] ** 2))
    assert left(errors, floors).certain == pytest.approx((own - 1.7 * 15.0**2) / RUNS, rel=1e-6)


def cyclic(size_n, error):
    """A run that repeats, with a noise of that size from cycle to cycle."""
    return NoiseFloor(size_n, "cycles", floor_of(error).lower_bound_n, cycles=8)


def test_runs_that_do_not_repeat_are_held_against_the_colour_of_those_that_do():
    rng = np.random.default_rng(6)
    errors = [coloured(rng, 0.6, 10.0) for _ in range(RUNS)]
    floors = [cyclic(10.0, e) if k < 7 else floor_of(e) for k, e in enumerate(errors)]
    assert left(errors, floors).excess == 0.0
    for k in (7, 8, 9):
        errors[k] = errors[k] + 30.0 * np.sin(0.02 * np.arange(N))
    found = left(errors, floors)
    assert found.measured
    assert found.judged < found.most_noise
    assert found.excess > 0.5 * 0.3 * 450.0


def test_noise_that_some_runs_show_is_granted_to_all_but_not_what_no_sensor_makes():
    rng = np.random.default_rng(8)
    errors = [coloured(rng, 0.93, 20.0) for _ in range(RUNS)]
    floors = [floor_of(e) for e in errors]
    floors[:3] = [cyclic(20.0, e) for e in errors[:3]]
    assert left(errors, floors).most_noise > 20.0**2
    assert left(errors, floors).excess == 0.0
    slow = [60.0 * np.sin(2e-3 * np.cumsum(rng.standard_normal(N))) + rng.normal(0.0, 5.0, N) for _ in errors]
    floors = [floor_of(e) for e in slow]
    floors[:3] = [cyclic(60.0, e) for e in slow[:3]]
    assert left(slow, floors).most_noise < 1.5 * (5.0 * 5.0) ** 2


def test_noise_remembers_no_more_than_where_runs_show_it():
    """A slow error in the runs that do not repeat has a colour that the sensor is known not to have."""
    rng = np.random.default_rng(9)
    errors = [4.0 * rng.standard_normal(N) for _ in range(RUNS)]
    slow = [e + coloured(rng, 0.97, 12.0) if k > 1 else e for k, e in enumerate(errors)]
    floors = [floor_of(e) for e in slow]
    known = [NoiseFloor(4.0, "cycles", f.lower_bound_n) for f in floors[:2]]
    assert left(slow, floors).excess == 0.0
    assert left(slow, [*known, *floors[2:]]).excess > 0.0


def test_what_the_motion_brings_is_told_apart():
    rng = np.random.default_rng(10)
    errors = [3.0 * rng.standard_normal(N) for _ in range(RUNS)]
    brought = [2.0 * rng.standard_normal(N) for _ in range(RUNS)]
    found = budget_of(errors, brought, [floor_of(e) for e in errors], [RATE_HZ] * RUNS)
    assert found.brought == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("certain", [0.0, 0.2])
@pytest.mark.parametrize(
    ("total", "measured", "unseen"),
    [(1.5, False, 0.0), (1.5, True, 0.25), (2.5, False, 2.5 - 1.0 - UNSEEN_DOUBT)],
)
def test_noise_that_was_not_measured_may_be_larger_where_nothing_is_seen_in_it(
    total, measured, unseen, certain
):
    budget = Budget(total, total, noise=1.0, measured=measured, most_noise=1.25, certain=certain)
    assert budget.excess == pytest.approx(total - 1.25)
    assert budget.unseen == pytest.approx(max(unseen, certain))
