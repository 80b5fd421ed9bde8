"""A current that is brought onto another clock is neither late nor early."""

import numpy as np
import pytest

from mrctl.measurements.onto import is_held, onto

GRID_S = np.arange(4000) / 1000.0
JITTER_S = 4e-4


def stamps(seed=1):
    """Times of a logger that is meant to sample at the grid's."""
    return np.sort(GRID_S + np.random.default_rng(seed).uniform(-JITTER_S, JITTER_S, GRID_S.size))


def late_s(truth, found):
    """By how much `found` (n) on the grid comes after truth(time), to first order."""
    slope = np.gradient(truth(GRID_S), GRID_S)
    return float(slope @ (truth(GRID_S) - found) / (slope @ slope))


def coil(time_s):
    """A coil's current in A after steps of the wish every 0.1 s."""
    since = time_s % 0.2
    up = 1.0 - np.exp(-since / 0.002)
    return np.where(since < 0.1, up, np.exp(-np.maximum(since - 0.1, 0.0) / 0.002))


def test_a_current_that_was_measured_is_on_time():
    rng = np.random.default_rng(2)
    time_s = stamps()
    measured = coil(time_s) + 1e-3 * rng.standard_normal(time_s.size)
    assert not is_held(GRID_S, time_s, measured, "current_a")
    found = onto(GRID_S, time_s, measured, "current_a")
    assert late_s(coil, found) == pytest.approx(0.0, abs=1e-4)  # s; held, it is half a sample


@pytest.mark.parametrize("name", ["current_a", "current_command_a"])
def test_a_wish_steps_at_the_nearest_instant_to_its_stamp(name):
    time_s = stamps()
    wish = np.floor(np.arange(time_s.size) / 50.0) % 2.0
    found = onto(GRID_S, time_s, wish, name)
    assert set(found) == {0.0, 1.0}  # no ramp
    assert np.count_nonzero(found != wish) == 0


@pytest.mark.parametrize("name", ["current_a", "current_command_a"])
def test_what_is_sent_as_it_changes_is_held(name):
    time_s = np.arange(40) / 10.0
    sent = np.arange(40) % 7.0
    found = onto(GRID_S, time_s, sent, name)
    assert np.array_equal(found[::100], sent)
    assert np.array_equal(found[40::100], sent)


def test_a_sensor_is_a_straight_line_between_samples():
    time_s = np.arange(5) / 2.0
    grid = np.arange(9) / 4.0
    assert onto(grid, time_s, np.arange(5.0), "force_n") == pytest.approx(np.arange(9) / 2.0)
