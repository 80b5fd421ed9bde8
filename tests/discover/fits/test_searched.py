from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from discover.hidden import bench_of

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits import searched
from mrctl.measurements.run import Campaign, Run

RATE_HZ = 4000.0
SLOW = ((0.5, 0.03), (1.0, 0.03), (2.0, 0.02))  # hertz, metres
FAST = ((2.0, 0.02), (11.0, 0.01))  # at once
KNEE_M_S = 0.02  # which the fast ones pass in a third of what a search takes for a sample
NOISE_N = 5.0


def _campaign(*fast: tuple[float, float]) -> Campaign:
    """Runs at two currents of a damper that answers at once."""
    random = np.random.default_rng(1)
    t = np.arange(int(4.0 * RATE_HZ)) / RATE_HZ
    runs = []
    for motion in (*((one,) for one in SLOW), *((fast,) if fast else ())):
        for current in (0.5, 2.0):
            v = sum(2 * np.pi * hz * stroke * np.cos(2 * np.pi * hz * t) for hz, stroke in motion)
            force = (100.0 + 200.0 * current) * (np.tanh(v / KNEE_M_S) + 0.3 * v)
            noisy = force + NOISE_N * random.standard_normal(t.size)
            runs.append(run_of(f"{len(runs)}", t, v, current, noisy))
    return Campaign(Path("fast"), tuple(runs), "0" * 64)


def run_of(name: str, t: np.ndarray, v: np.ndarray, current_a: float, force_n: np.ndarray) -> Run:
    still, x, a = np.ones(t.size), np.cumsum(v) / RATE_HZ, np.gradient(v) * RATE_HZ
    return Run(name, Path(f"{name}.csv"), t, v, current_a * still, 40.0 * still, force_n, x, a, RATE_HZ)


def test_runs_that_turn_too_fast_are_searched_at_higher_rates():
    evidence = Evidence.of(_campaign(*FAST))
    coarse = evidence.base()
    resolved = evidence.resolved(coarse.fit)
    assert resolved.times == (1, 1, 1, 1, 1, 1, 2, 2)
    rates = [r.rate_hz / k for r, k in zip(resolved.records, resolved.times, strict=True)]
    assert rates == [r.rate_hz for r in evidence.records]
    fine = resolved.base(start=coarse.fit)
    left = [
        np.sqrt(p.mean_square + e.averaged_away_n2(p.fit)) for p, e in ((coarse, evidence), (fine, resolved))
    ]
    assert left[1] < 1.05 * NOISE_N < left[0]


def test_runs_that_turn_slowly_stay_as_they_are():
    evidence = Evidence.of(_campaign())
    assert evidence.resolved(evidence.base().fit) is evidence


def test_noise_of_the_motion_is_no_fast_turn():
    random = np.random.default_rng(0)
    plain = _campaign()
    runs = [
        replace(r, velocity_m_s=r.velocity_m_s + 0.1 * random.standard_normal(r.velocity_m_s.size))
        for r in plain.runs
    ]
    evidence = Evidence.of(replace(plain, runs=tuple(runs)))
    fit = evidence.base().fit
    finer = searched.at_search_rates(evidence.measured, evidence.floors, list, (2,) * len(runs))[1]
    apart = zip(*(fit.model.on(some).predict(fit.theta) for some in (evidence.records, finer)), strict=True)
    assert any(np.std(a - b[: 2 * a.size].reshape(-1, 2).mean(axis=1)) > 0.01 * np.std(a) for a, b in apart)
    assert evidence.resolved(fit) is evidence


@pytest.mark.parametrize("rate_hz", [500.0, 4000.0])
def test_a_long_campaign_is_searched_at_half_the_rates_but_where_told(rate_hz, monkeypatch):
    monkeypatch.setattr(searched, "LONG_S", 1.0)
    bench = bench_of({}, 2)
    runs = [bench.run(f"{k}", *bench.road(rate_hz, 4.0), 1.0, 40.0) for k in range(2)]
    evidence = Evidence.of(Campaign(Path("long"), tuple(runs), "0" * 64))
    usual, told = (
        searched.at_search_rates(evidence.measured, evidence.floors, list, times)[1] for times in ((), (1, 2))
    )
    assert [r.rate_hz for r in usual] == [500.0, 500.0]
    assert [r.rate_hz for r in told] == [500.0, 1000.0]


def test_an_error_is_told_at_the_samples_measured():
    evidence = Evidence.of(_campaign())
    base = evidence.base()
    assert np.sqrt(base.mean_square) < 0.6 * NOISE_N
    assert np.sqrt(base.mean_square + evidence.averaged_away_n2(base.fit)) == pytest.approx(NOISE_N, rel=0.02)
