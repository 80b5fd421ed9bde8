"""A current that a controller sets all the time, seen at another rate than the controller's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from discover.campaigns import earlier_than_middle, every
from identify.virtual import Bench, random_damper

from mrctl.discover.channels.dense_steps import FEWEST_SHARED, at_once, dense_steps, shares_of
from mrctl.discover.evidence import Evidence
from mrctl.measurements.run import Campaign

FINE_HZ, KEPT, CYCLE = 4000.0, 8, 29  # samples at 500 Hz, a controller's cycle of 7.25 ms
SPAN = 25
RNG = np.random.default_rng(8)


@pytest.fixture(scope="module")
def switched():
    """Runs of a controller that switches on and off, and how much earlier than mid-interval each step was."""
    bench = Bench(random_damper(4), np.random.default_rng(4), 1.0)
    runs, earlier = [], []
    for k in range(4):
        t, v = bench.road(FINE_HZ, 4.0)
        cycles = t.size // CYCLE + 1
        wish = np.where(bench.random.random(cycles) < 0.5, 0.0, bench.random.choice([1.0, 2.0, 3.0], cycles))
        current = np.repeat(wish, CYCLE)[: t.size]
        runs.append(every(bench.run(f"{k}", t, v, current, 40.0), KEPT))
        earlier.append(earlier_than_middle(np.flatnonzero(np.diff(current)) + 1, KEPT))
    return Campaign(Path("switched"), tuple(runs), "0" * 64), earlier


def test_the_times_are_told_apart_and_the_error_falls(switched):
    campaign, earlier = switched
    evidence = Evidence.of(campaign)
    before = evidence.base()
    timed = evidence.timed(before.fit)
    after = timed.base((), {}, before.fit)
    assert after.mean_square < 0.15 * before.mean_square
    again = evidence.timed(after.fit)
    told, true, size = [], [], []
    for run, old, new, share in zip(campaign.runs, evidence.records, again.records, earlier, strict=True):
        steps = np.flatnonzero(np.diff(run.current_a))
        by = np.diff(run.current_a)[steps]
        gain = np.add.reduceat(new.current_a - old.current_a, steps * old.finer) / (by * old.finer)
        told.append(gain)
        true.append(share)
        size.append(np.abs(by * run.velocity_m_s[steps]))
    told, true, size = (np.concatenate(x) for x in (told, true, size))
    loud = size > np.quantile(size, 0.75)  # at rest the force does not answer
    assert np.corrcoef(told[loud], true[loud])[0, 1] > 0.8


def test_a_slope_is_no_step_and_neighbours_in_rest_are():
    slope = 0.5 + 0.5 * np.sin(2.0 * np.pi * 8.0 * np.arange(400) / 250.0)
    assert dense_steps(np.abs(np.diff(slope)), 0.03).size == 0
    held = np.repeat(RNG.permutation(20) / 20.0, 3)
    assert dense_steps(np.abs(np.diff(held)), 0.03).tolist() == list(range(2, 57, 3))


def test_how_many_answers_meet():
    assert at_once(np.array([3, 5, 9, 40]), 5) == 2
    assert at_once(np.array([3, 5, 7, 40]), 5) == 3
    assert at_once(np.array([], dtype=int), 5) == 0


def test_answers_that_meet_are_told_apart_and_without_any_the_middle_stays():
    at = np.array([2, 5, 8, 13, 60])
    true = np.array([0.3, -0.4, 0.1, -0.2, 0.45])
    decay = np.exp(-np.arange(SPAN) / 6.0)

    def errors(shares):
        out = 0.01 * np.random.default_rng(2).normal(size=100)
        for k, share, aim in zip(at, shares[0], true, strict=True):
            out[k : k + SPAN] += (share - aim) * decay
        return [out, np.zeros(0)]

    none = np.zeros(0, dtype=int)
    told, empty = shares_of([at, none], [SPAN, SPAN], errors)
    assert told == pytest.approx(true, abs=0.05)
    assert empty.size == 0

    still = RNG.normal(size=100)
    assert np.abs(shares_of([at, none], [SPAN, SPAN], lambda _: [still, none])[0]).max() == 0.0


def _noisy(true, at, noise, seed=5):
    """Answers that no single step tells the time of."""
    decay = np.exp(-np.arange(SPAN) / 6.0)
    size = at[-1] + SPAN + 5
    white = noise * np.random.default_rng(seed).normal(size=size)

    def errors(shares):
        out = white.copy()
        for k, share, aim in zip(at, shares[0], true, strict=True):
            out[k : k + SPAN] += (share - aim) * decay
        return [out]

    return errors


def test_the_steps_of_a_clock_that_goes_with_the_loggers_have_one_time():
    at = 2 + 40 * np.arange(80)
    true = np.full(at.size, 0.25)
    few = slice(FEWEST_SHARED - 1)
    (alone,) = shares_of([at[few]], [SPAN], _noisy(true[few], at[few], 0.3))
    (together,) = shares_of([at], [SPAN], _noisy(true, at, 0.3))
    assert np.sqrt(np.mean((alone - 0.25) ** 2)) > 0.08
    assert np.sqrt(np.mean((together - 0.25) ** 2)) < 0.05


def test_the_steps_of_another_clock_keep_times_of_their_own():
    at = 2 + 40 * np.arange(80)
    true = np.random.default_rng(4).uniform(-0.5, 0.5, at.size)
    (told,) = shares_of([at], [SPAN], _noisy(true, at, 0.1))
    assert np.std(told - true) < 0.1
    assert np.corrcoef(told, true)[0, 1] > 0.95
