"""The start that little data promises most of is not always the one to go on from."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.fits.race import CLOSE, HEAT, LOST, near_cost, raced

MORE_HEATS = 4
A, B = np.array([1.0]), np.array([2.0])


@pytest.mark.parametrize(("ends_at", "fits", "best"), [(0.5, 1, A), (50.0, 2, B)])
def test_where_all_data_speak_against_the_choice_another_start_is_tried(ends_at, fits, best):
    """ends_at: the cost on all data to which the fit from A, which the heats prefer, comes."""
    on_all = {1.0: 60.0, 2.0: 10.0}
    ends = {1.0: ends_at, 2.0: 4.0}
    asked = []

    def heat(theta, **_):
        return SimpleNamespace(theta=theta, total=float(theta[0]), solution=there)

    there = SimpleNamespace(converged=True, last_gain=0.0)

    def fitted(theta, **_):
        asked.append(float(theta[0]))
        return SimpleNamespace(theta=theta + 10.0, total=ends[float(theta[0])], solution=there)

    def cost(theta):
        place = float(theta[0])
        return ends[place - 10.0] if place > 10.0 else on_all[place]

    fit = raced([A, B], heat, fitted, cost, 20)
    assert len(asked) == fits
    assert np.array_equal(fit.theta, best + 10.0)


@pytest.mark.parametrize(("last_gain", "asked"), [(1.0, [HEAT]), (5.0, [HEAT, 20 - HEAT])])
def test_a_fit_that_is_not_on_its_way_below_what_is_known_ends_early(last_gain, asked):
    """At a cost of 100 after the first iterations, with 16 more to come, where a fit of 50 is known."""
    asked_for = []

    def fitted(theta, *, iterations: int, **_):
        asked_for.append(iterations)
        return SimpleNamespace(theta=theta, total=100.0, solution=there)

    there = SimpleNamespace(converged=False, last_gain=last_gain)
    done = SimpleNamespace(theta=A, total=1.0, solution=SimpleNamespace(converged=True, last_gain=0.0))
    raced([A], lambda *_, **__: done, fitted, lambda _: 100.0, 20, 50.0)
    assert asked_for == asked


@pytest.mark.parametrize(("few", "asked"), [(2.0, [HEAT, 20 - HEAT]), (0.5, [LOST])])
def test_what_a_few_data_show_to_come_to_nothing_is_not_gone_on_with_on_all(few, asked):
    """few: what is known of them, where the fit to them ends at 1."""
    asked_for, known_of = [], []

    def heat(theta, *, known=np.inf, **_):
        known_of.append(known)
        return SimpleNamespace(theta=theta, total=1.0, solution=done)

    def fitted(theta, *, iterations: int, **_):
        asked_for.append(iterations)
        going = SimpleNamespace(converged=False, last_gain=10.0)
        return SimpleNamespace(theta=theta, total=100.0, solution=going)

    done = SimpleNamespace(converged=True, last_gain=0.0)
    fit = raced([A, B], heat, fitted, lambda theta: 100.0 - theta[0], 20, few=few)
    assert asked_for[: len(asked)] == asked
    assert np.array_equal(fit.theta, B if asked == [LOST] else A)
    assert known_of[-1] == few


def test_a_fit_is_near_the_best_one_by_a_share_of_its_log_likelihood_ratio():
    assert near_cost(1000.0, 10.0) == pytest.approx(1000.0 * 0.01**CLOSE)
    assert near_cost(1000.0, 2000.0) == 1000.0  # a best one that is worse than none holds nobody back


def _falling(falls):
    """A heat from each start, by its first value: it stands at a cost and takes `falls` off it each time."""

    def heat(theta, **_):
        start, cost = theta
        after = cost - falls[start]
        there = SimpleNamespace(converged=not falls[start], last_gain=falls[start])
        return SimpleNamespace(theta=np.array([start, after]), total=after, solution=there)

    return heat


@pytest.mark.parametrize(
    ("falls", "taken", "at"),
    [
        ({1.0: 10.0, 2.0: 60.0}, 2.0, 200.0 - 60.0 * (1 + MORE_HEATS)),  # it comes by
        ({1.0: 0.0, 2.0: 30.0}, 1.0, 100.0),  # as much again would still be more
    ],
)
def test_a_start_that_still_falls_steeply_is_heated_on(falls, taken, at):
    """From 100 and 200: after a heat the second still costs more."""
    heat = _falling(falls)
    there = SimpleNamespace(converged=True, last_gain=0.0)

    def fitted(theta, **_):
        return SimpleNamespace(theta=theta, total=0.0, solution=there)

    fit = raced(
        [np.array([1.0, 100.0]), np.array([2.0, 200.0])], heat, fitted, lambda _: 0.0, 20, more=MORE_HEATS
    )
    assert fit.theta[0] == taken
    assert fit.theta[1] == at
