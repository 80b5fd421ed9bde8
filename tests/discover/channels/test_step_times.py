"""A current that steps between two samples."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from discover.campaigns import earlier_than_middle, every
from identify.virtual import Bench, random_damper

from mrctl.discover.channels.step_times import lone_steps, without_steps
from mrctl.discover.evidence import Evidence
from mrctl.identify import hysteresis
from mrctl.identify.finish import damper_of
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper
from mrctl.model.filters import Filter

FINE_HZ, RATE_HZ = 4000.0, 500.0
KEPT = int(FINE_HZ / RATE_HZ)
NOISE_N = 1.0
QUICK_HZ, SELDOM = 90.0, 16  # a lag shorter than the sampling interval of every 16th sample


@pytest.fixture(scope="module")
def stepped() -> tuple[Campaign, list[np.ndarray]]:
    """Runs at 500 Hz whose current steps at any time, and how much earlier than mid-interval each was."""
    return _stepped(random_damper(4), KEPT)


def _stepped(damper: Damper, kept: int) -> tuple[Campaign, list[np.ndarray]]:
    bench = Bench(damper, np.random.default_rng(4), NOISE_N)
    runs, earlier = [], []
    for k in range(5):
        t, v = bench.road(FINE_HZ, 5.0)
        at = np.sort(bench.random.choice(np.arange(1, 24), 8, replace=False)) * 800
        at += bench.random.integers(0, 800 // 2, at.size)  # none nearer than 100 ms to another
        current = np.zeros(t.size)
        for n, start in enumerate(at):
            current[start:] = (2.0, 0.5, 3.0, 1.0)[n % 4]
        runs.append(every(bench.run(f"{k}", t, v, current, 40.0), kept))
        earlier.append(earlier_than_middle(at, kept))
    return Campaign(Path("stepped"), tuple(runs), "0" * 64), earlier


def test_the_times_are_taken_from_the_force_and_the_error_falls(stepped):
    campaign, earlier = stepped
    evidence = Evidence.of(campaign)
    before = evidence.base()
    timed = evidence.timed(before.fit)
    after = timed.base((), {}, before.fit)
    assert after.mean_square < 0.6 * before.mean_square
    found = []
    for old, new in zip(evidence.records, timed.records, strict=True):
        moved = (new.current_a - old.current_a).sum() / evidence.records[0].rate_hz * RATE_HZ
        found.append(moved)
    expected = []
    for run, share in zip(campaign.runs, earlier, strict=True):
        at = np.flatnonzero(np.abs(np.diff(run.current_a)) > 0.1)
        expected.append(float(np.sum(share * np.diff(run.current_a)[at])))
    assert np.corrcoef(found, expected)[0, 1] > 0.9


def test_a_short_lag_is_seen_where_no_step_was():
    decay = np.exp(-2.0 * np.pi * QUICK_HZ / FINE_HZ)
    quick = Filter.of(FINE_HZ, (1.0 - decay,), (1.0, -decay))
    campaign, _ = _stepped(replace(random_damper(4), forward_filter=quick), SELDOM)
    evidence = Evidence.of(campaign)
    hz = np.array([40.0, 80.0, 120.0])

    def miss(fit: JointFit) -> float:
        found = damper_of(fit).forward_filter.response(hz)
        return float(np.max(np.abs(np.abs(found) - np.abs(quick.response(hz)))))

    plain = evidence.base().fit
    slow = plain.theta.copy()
    slow[plain.model.layout.parts["filter"]] = hysteresis.lag(0.3 * QUICK_HZ)
    made_up = replace(plain, solution=replace(plain.solution, theta=slow))  # for the steps' times
    stepless = evidence.stepless(made_up)
    timed = evidence.timed(stepless).base((), {}, stepless).fit
    assert miss(made_up) > 0.15
    assert miss(stepless) < 0.03
    assert miss(timed) < 0.05


def test_the_currents_as_measured_are_kept_for_another_model(stepped):
    evidence = Evidence.of(stepped[0])
    timed = evidence.timed(evidence.base().fit)
    for old, kept in zip(evidence.measured, timed.measured, strict=True):
        assert kept is old


def test_only_steps_that_stand_alone_are_looked_at():
    current = np.zeros(1000)
    current[200:] = 1.0
    current[400:] = 2.0
    current[410:] = 0.5  # 20 ms later: neither of the two can be timed
    current[700:900] += np.linspace(0.0, 1.0, 200)  # a ramp
    flat = np.zeros(1000)
    record = Record(0, RATE_HZ, flat, current, flat, flat, flat, flat)
    assert lone_steps(record, 0.1).tolist() == [199, 899]


def test_what_hangs_on_a_step_between_two_samples_is_left_out_and_nothing_else():
    current, flat = np.zeros(1000), np.zeros(1000)
    current[300:] = 2.0
    current[600:650] += np.linspace(0.0, 1.0, 50)  # a slope: no step
    current[650:] += 1.0
    record = Record(0, RATE_HZ, flat, current, flat, flat, flat, flat)
    error = np.random.default_rng(1).standard_normal(900)  # the record's last 900 samples
    error[200:203] = 80.0
    left = without_steps(record, error)
    assert np.max(np.abs(left[199:204])) < 4.0
    untouched = np.r_[0:200, 203:900]
    assert left[untouched] == pytest.approx(error[untouched])
    steady = Record(0, RATE_HZ, flat, np.ones(1000), flat, flat, flat, flat)
    assert without_steps(steady, error) is error
