"""What a rig does to its channels is no physics: a load cell's zero in each run, a current written late."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from discover.campaigns import shipped, sine, with_effect
from discover.hidden import among
from identify.virtual import Bench, random_damper
from scipy.stats import chi2

from mrctl.discover.channels.current_clock import current_late_s, earlier
from mrctl.discover.channels.load_cell import LoadCell
from mrctl.discover.channels.run_gains import run_gains
from mrctl.discover.channels.run_zeros import run_zeros
from mrctl.discover.channels.runs_own import Own
from mrctl.discover.diagnose import diagnose
from mrctl.discover.evidence import Evidence
from mrctl.discover.reports.figures import diagnosis_figures, verdict_words
from mrctl.identify.records import Record
from mrctl.measurements.run import Campaign, Run

RATE_HZ = 1000.0
CURRENTS_A = np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0])
SPREAD_N = np.array([6.0, -4.0, 2.0, -7.0, 3.0, 0.0])


def seen(values: np.ndarray, doubt: float = 0.1) -> Own:
    """What is seen of runs of such zeros or scales."""
    apart = (values - values.mean()) / doubt
    noise = doubt * np.random.default_rng(1).standard_normal(values.size)
    return Own(values + noise, np.full(values.size, doubt), float(chi2.sf(apart @ apart, values.size - 1)))


def driven(count: int = 6, currents_a: np.ndarray = CURRENTS_A) -> list[Record]:
    """Runs of +-1 kN at rising currents, at one temperature."""
    wave, steady = np.array([-1.0, 1.0]), np.ones(2)
    return [
        Record(k, RATE_HZ, wave, i * steady, 20.0 * steady, 1e3 * wave, wave, wave)
        for k, i in enumerate(currents_a[:count])
    ]


def test_each_runs_zero_is_what_is_seen_of_it():
    zeros = run_zeros(seen(SPREAD_N), driven(), np.zeros(6))
    assert zeros == pytest.approx(SPREAD_N, abs=0.4)


def test_an_offset_of_all_runs_is_an_effect_and_stays():
    zeros = run_zeros(seen(SPREAD_N + 40.0), driven(), np.zeros(6))
    assert zeros == pytest.approx(SPREAD_N, abs=0.4)


def test_zeros_taken_already_count():
    zeros = run_zeros(seen(np.zeros(6)), driven(), SPREAD_N)
    assert zeros == pytest.approx(SPREAD_N, abs=0.4)


@pytest.mark.parametrize(("size", "taken"), [(10.0, True), (30.0, False)])
def test_of_many_runs_a_few_may_have_far_zeros(size, taken):
    """Their spread is 1 % of the force, and the farthest 3 %; or 3 %, which no rig has."""
    means = size * np.random.default_rng(3).permutation([*np.linspace(-1.0, 1.0, 15), 3.0])
    zeros = run_zeros(seen(means), driven(16, np.tile([0.0, 1.0, 2.0, 1.0], 4)), np.zeros(16))
    assert zeros == pytest.approx(means if taken else 0.0, abs=0.4)


@pytest.mark.parametrize(
    "means",
    [np.tile([-10.0, 20.0, -10.0], 5), np.append(0.1 * np.arange(15.0), 55.0)],
    ids=["goes with the current's square", "one run alone, by more than any rig"],
)
def test_far_zeros_of_many_runs_follow_no_rule(means):
    count = means.size
    runs = driven(count, np.tile([0.0, 1.0, 2.0], 6))
    assert not run_zeros(seen(means, 0.02), runs, np.zeros(count)).any()


@pytest.mark.parametrize(
    "means",
    [np.full(6, 3.0), 4.0 * SPREAD_N, SPREAD_N[:2], 8.0 * (1.0 - CURRENTS_A) + 0.1 * SPREAD_N],
    ids=["all alike", "more than a load cell wanders", "two runs", "goes with the current"],
)
def test_what_is_no_zero_is_left_alone(means):
    assert not run_zeros(seen(means), driven(means.size), np.zeros(means.size)).any()


def steady_runs(damper, zeros_n=SPREAD_N) -> Campaign:
    runs = [
        sine(damper, frequency_hz=hz, amplitude_m=0.06 / hz, current_a=i, cycles=6, name=f"{k}.csv", seed=k)
        for k, (hz, i) in enumerate(((1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (3.0, 1.0), (1.0, 2.0), (3.0, 2.0)))
    ]
    offset = [replace(r, force_n=r.force_n + 1.5 * z) for r, z in zip(runs, zeros_n, strict=True)]
    return Campaign(Path("zeros"), tuple(offset), "0" * 64)


def test_runs_with_zeros_of_their_own_miss_nothing_and_it_is_said():
    diagnosis = diagnose(steady_runs(shipped()))
    assert diagnosis.verdict == "none"
    assert diagnosis.evidence.cell.zeros_n == pytest.approx(
        1.5 * SPREAD_N, abs=3.0
    )  # of two runs at a current
    assert "zero" in verdict_words(diagnosis)
    assert diagnosis_figures(diagnosis)["channels"]["zeros_n"]["0.csv"] == pytest.approx(9.0, abs=2.0)


@pytest.mark.long
def test_a_true_offset_beside_them_is_not_taken_for_zeros(monkeypatch):
    among(monkeypatch, "force_offset", "gas_spring", "coulomb_friction", "rebound_asymmetry")
    diagnosis = diagnose(steady_runs(with_effect(shipped(), "force_offset", offset_n=120.0)))
    assert "force_offset" in diagnosis.effects
    assert np.abs(diagnosis.evidence.cell.zeros_n).max() < 20.0


def test_what_a_wrong_model_misses_in_the_mean_is_no_zero():
    evidence = Evidence.of(steady_runs(shipped()))
    zeroed = evidence.zeroed(evidence.base().fit)
    assert zeroed.cell.zeros_n.any()
    again = zeroed.as_measured()
    for before, after in zip(evidence.full, again.full, strict=True):
        assert after.force_n == pytest.approx(before.force_n)
    assert not again.cell.zeros_n.any()


GAINS = np.array([0.008, -0.011, 0.004, -0.006, 0.012, -0.007])


def test_each_runs_scale_is_what_is_seen_of_it():
    assert run_gains(seen(GAINS, 1e-4), driven()) == pytest.approx(GAINS - GAINS.mean(), abs=5e-4)


def test_a_scale_of_all_runs_is_the_models():
    assert run_gains(seen(GAINS + 0.02, 1e-4), driven()) == pytest.approx(GAINS - GAINS.mean(), abs=5e-4)


@pytest.mark.parametrize(
    "gains",
    [
        np.full(6, 0.01),
        0.1 * GAINS,
        10.0 * GAINS,
        GAINS[:5],
        0.01 * CURRENTS_A,
        0.02 * (CURRENTS_A - 1.0) ** 2,
    ],
    ids=[
        "all alike",
        "next to none",
        "more than a rig scatters",
        "few runs",
        "goes with the current",
        "with its square",
    ],
)
def test_what_is_no_scale_is_left_alone(gains):
    assert not run_gains(seen(gains, 1e-4), driven(gains.size)).any()


def _scattered(campaign: Campaign, gains: np.ndarray) -> Campaign:
    each = zip(campaign.runs, gains, strict=True)
    return replace(campaign, runs=tuple(replace(r, force_n=(1.0 + g) * r.force_n) for r, g in each))


def test_runs_with_scales_of_their_own_miss_nothing_and_it_is_said():
    diagnosis = diagnose(_scattered(steady_runs(shipped()), GAINS))
    assert diagnosis.verdict == "none"
    gains = diagnosis.evidence.cell.gains
    assert gains[1] - gains[0] == pytest.approx(GAINS[1] - GAINS[0], rel=0.3)
    most = diagnosis.evidence.campaign.runs[int(np.argmax(np.abs(GAINS - GAINS.mean())))].name
    words = verdict_words(diagnosis)
    assert "scale differs from run to run" in words
    assert f"most in {most} (" in words
    assert diagnosis_figures(diagnosis)["channels"]["gains"]


@pytest.mark.long
def test_fewer_runs_may_differ_in_scale_where_no_effect_explains_it():
    assert run_gains(seen(GAINS[:5], 1e-4), driven(5), 3) == pytest.approx(
        GAINS[:5] - GAINS[:5].mean(), abs=5e-4
    )
    campaign = _scattered(steady_runs(shipped()), 2.0 * GAINS)
    diagnosis = diagnose(replace(campaign, runs=campaign.runs[:5]))
    assert diagnosis.verdict == "none"
    assert "scale differs from run to run" in verdict_words(diagnosis)


def test_what_a_wrong_model_leaves_is_no_scale():
    spring = with_effect(shipped(), "gas_spring", preload_n=0.0, stiffness_n_m=4000.0, progression_per_m=0.0)
    evidence = Evidence.of(_scattered(steady_runs(spring), GAINS))
    base = evidence.base()
    assert evidence.evened(base.fit) is evidence


def test_a_load_cell_is_put_back():
    evidence = Evidence.of(steady_runs(shipped()))
    cell = LoadCell(SPREAD_N, GAINS)
    taken = cell.instead_of(evidence.cell, evidence.full)
    assert taken[0].force_n == pytest.approx((evidence.full[0].force_n - SPREAD_N[0]) / (1.0 + GAINS[0]))
    for before, after in zip(evidence.full, evidence.cell.instead_of(cell, taken), strict=True):
        assert after.force_n == pytest.approx(before.force_n)


def changing(late: int, *, in_steps: bool = False) -> Campaign:
    """Runs whose current changes smoothly, or in steps, written that many samples late (or early)."""
    bench = Bench(random_damper(7), np.random.default_rng(7), 5.0)
    runs = []
    for k in range(4):
        t, v = bench.road(RATE_HZ, 6.0)
        current = 1.5 + 1.4 * np.sin(2 * np.pi * (1.1 + 0.6 * k) * t + k)
        if in_steps:
            current = np.random.default_rng(k).uniform(0.0, 3.0, 16)[(t // 0.4).astype(int)]
        run = bench.run(f"{k}", t, v, current, 30.0)
        runs.append(replace(run, current_a=np.roll(run.current_a, late)))
    return Campaign(Path("late"), tuple(_inner(run, 20) for run in runs), "0" * 64)


def _inner(run: Run, left_out: int) -> Run:
    """Without both ends, where a channel was rolled over them."""
    whole = slice(left_out, -left_out)
    names = ("velocity_m_s", "current_a", "temperature_c", "force_n", "displacement_m", "acceleration_m_s2")
    kept = {name: getattr(run, name)[whole] for name in names}
    return replace(run, time_s=run.time_s[whole] - run.time_s[left_out], **kept)


@pytest.mark.parametrize(("late", "found"), [(3, 3e-3), (1, 1e-3), (0, 0.0), (-2, 0.0)])
def test_a_current_written_late_is_noticed_and_one_that_acts_late_is_left_to_physics(late, found):
    evidence = Evidence.of(changing(late))
    base = evidence.base()
    assert current_late_s(base.fit) == pytest.approx(found, abs=0.35e-3)
    assert (evidence.synchronised(base.fit) is evidence) == (found == 0.0)


@pytest.mark.parametrize("looks_s", [4.9e-3, 2.1e-3])
def test_how_late_steps_were_written_a_fit_tells_to_the_sample(monkeypatch, looks_s):
    monkeypatch.setattr("mrctl.discover.evidence.current_late_s", lambda _: looks_s)
    evidence = Evidence.of(changing(4, in_steps=True))
    early = evidence.synchronised(evidence.base().fit)
    assert round(early.current_late_s * RATE_HZ) == 4


def test_a_step_of_the_current_stays_one():
    record = Evidence.of(changing(0)).measured[0]
    stepped = replace(record, current_a=np.where(np.arange(len(record)) < 1000, 0.0, 2.0))
    moved = earlier(stepped, 2.4e-3)
    assert np.flatnonzero(np.diff(moved.current_a)).tolist() == [997]
