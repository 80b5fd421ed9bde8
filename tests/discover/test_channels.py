"""What a rig does to its channels is no physics: a load cell's zero in each run, a current written late."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from discover.campaigns import shipped, sine, with_effect
from identify.virtual import Bench, random_damper

from mrctl.discover.current_clock import current_late_s, earlier
from mrctl.discover.diagnose import diagnose
from mrctl.discover.evidence import Evidence
from mrctl.discover.figures import diagnosis_figures, verdict_words
from mrctl.discover.run_zeros import run_zeros
from mrctl.identify.records import Record
from mrctl.measurements.run import Campaign, Run

RATE_HZ = 1000.0
CURRENTS_A = np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0])
SPREAD_N = np.array([6.0, -4.0, 2.0, -7.0, 3.0, 0.0])


def left(means: np.ndarray, noise_n: float = 5.0) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    return [m + noise_n * rng.standard_normal(4000) for m in means]


def driven(count: int = 6) -> list[Record]:
    """Runs of +-1 kN at rising currents, at one temperature."""
    wave, steady = np.array([-1.0, 1.0]), np.ones(2)
    return [
        Record(k, RATE_HZ, wave, i * steady, 20.0 * steady, 1e3 * wave, wave, wave)
        for k, i in enumerate(CURRENTS_A[:count])
    ]


def test_each_runs_zero_is_what_its_error_has_in_the_mean():
    zeros = run_zeros(left(SPREAD_N), driven(), np.zeros(6))
    assert zeros == pytest.approx(SPREAD_N, abs=0.4)


def test_an_offset_of_all_runs_is_an_effect_and_stays():
    zeros = run_zeros(left(SPREAD_N + 40.0), driven(), np.zeros(6))
    assert zeros == pytest.approx(SPREAD_N, abs=0.4)


def test_zeros_taken_already_count():
    zeros = run_zeros(left(np.zeros(6)), driven(), SPREAD_N)
    assert zeros == pytest.approx(SPREAD_N, abs=0.4)


@pytest.mark.parametrize(
    "means",
    [np.full(6, 3.0), 4.0 * SPREAD_N, SPREAD_N[:2], 8.0 * (1.0 - CURRENTS_A) + 0.1 * SPREAD_N],
    ids=["all alike", "more than a load cell wanders", "two runs", "goes with the current"],
)
def test_what_is_no_zero_is_left_alone(means):
    assert not run_zeros(left(means), driven(means.size), np.zeros(means.size)).any()


def steady_runs(damper, zeros_n=SPREAD_N) -> Campaign:
    runs = [
        sine(damper, frequency_hz=hz, amplitude_m=0.06 / hz, current_a=i, cycles=10, name=f"{k}.csv", seed=k)
        for k, (hz, i) in enumerate(((1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (3.0, 1.0), (1.0, 2.0), (3.0, 2.0)))
    ]
    offset = [replace(r, force_n=r.force_n + 1.5 * z) for r, z in zip(runs, zeros_n, strict=True)]
    return Campaign(Path("zeros"), tuple(offset), "0" * 64)


def test_runs_with_zeros_of_their_own_miss_nothing_and_it_is_said():
    diagnosis = diagnose(steady_runs(shipped()))
    assert diagnosis.verdict == "none"
    assert diagnosis.evidence.zeros_n == pytest.approx(1.5 * SPREAD_N, abs=3.0)  # of two runs at a current
    assert "zero" in verdict_words(diagnosis)
    assert diagnosis_figures(diagnosis)["channels"]["zeros_n"]["0.csv"] == pytest.approx(9.0, abs=2.0)


def test_a_true_offset_beside_them_is_not_taken_for_zeros():
    diagnosis = diagnose(steady_runs(with_effect(shipped(), "force_offset", offset_n=120.0)))
    assert "force_offset" in diagnosis.effects
    assert np.abs(diagnosis.evidence.zeros_n).max() < 20.0


def test_what_a_wrong_model_misses_in_the_mean_is_no_zero():
    evidence = Evidence.of(steady_runs(shipped()))
    zeroed = evidence.zeroed(evidence.base().fit)
    assert zeroed.zeros_n.any()
    again = zeroed.as_measured()
    for before, after in zip(evidence.full, again.full, strict=True):
        assert after.force_n == pytest.approx(before.force_n)
    assert not again.zeros_n.any()


def changing(late: int) -> Campaign:
    """Runs whose current changes smoothly, written that many samples late (or early)."""
    bench = Bench(random_damper(7), np.random.default_rng(7), 5.0)
    runs = []
    for k in range(4):
        t, v = bench.road(RATE_HZ, 6.0)
        run = bench.run(f"{k}", t, v, 1.5 + 1.4 * np.sin(2 * np.pi * (1.1 + 0.6 * k) * t + k), 30.0)
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


def test_a_step_of_the_current_stays_one():
    record = Evidence.of(changing(0)).measured[0]
    stepped = replace(record, current_a=np.where(np.arange(len(record)) < 1000, 0.0, 2.0))
    moved = earlier(stepped, 2.4e-3)
    assert np.flatnonzero(np.diff(moved.current_a)).tolist() == [997]
