"""Poles below the slowest motion: kept where they are true, not where they make up for something else."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import cont2discrete

from mrctl.identify import best, hysteresis, slow_poles
from mrctl.identify.best import fit_base, identify_best
from mrctl.identify.forward import modelled
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record, records_of
from mrctl.identify.slow_poles import slowest_motion_hz
from mrctl.measurements import load_campaign
from mrctl.measurements.run import Run
from mrctl.model.damper import Damper
from mrctl.model.filters import Filter

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "measurements"))
from utfsm_maps import RAW_MAP, SINES_MAP, UTFSM
from virtual import NOISE_N, Bench, random_damper


def filter_with(pole_hz: float, zero_hz: float) -> Filter:
    """A slow pole and its zero, and a lag at 60 Hz."""
    p, z, far = (2 * np.pi * hz for hz in (pole_hz, zero_hz, 60.0))
    num, den = np.array([1.0 / z, 1.0]), np.convolve([1.0 / p, 1.0], [1.0 / far, 1.0])
    b, a, _ = cont2discrete((num, den), 1 / 2000.0, "bilinear")
    return Filter.of(2000.0, b.ravel(), a)


def slowest_hz(fit: JointFit) -> float:
    part = fit.model.layout.parts["filter"]
    poles = np.roots(hysteresis.denominator(fit.theta[part][:3]))
    return float(np.min(np.abs(poles))) * hysteresis.UNIT_RAD_S / (2 * np.pi)


def sines(hz: float) -> list[Record]:
    """Two runs that hold nothing but motion of that frequency."""
    t = np.arange(4000) / 1000.0
    v, none = 0.1 * np.cos(2 * np.pi * hz * t), np.zeros(t.size)
    return [Record(n, 1000.0, v, none, none, v, none, none) for n in range(2)]


def fit_percent(damper: Damper, runs: Sequence[Run]) -> float:
    """NRMSE fit of all runs together, without their means: the real sines come without theirs."""
    left = [np.var(r.force_n - modelled(damper, r)) * len(r) for r in runs]
    return 100.0 * float(1.0 - np.sqrt(sum(left) / sum(np.var(r.force_n) * len(r) for r in runs)))


def test_one_real_motion_says_something_of_the_others(monkeypatch, tmp_path) -> None:
    """This damper's loop is no linear filter's: a pole below the motion makes up for some of it."""
    if not UTFSM.exists():
        pytest.skip(f"REAL DATA NOT TESTED: missing {UTFSM}")
    campaigns = {}
    for name, text in (("one", RAW_MAP), ("others", SINES_MAP)):
        (tmp_path / f"{name}.yaml").write_text(text)
        campaigns[name] = load_campaign(UTFSM, tmp_path / f"{name}.yaml")
    within = identify_best(campaigns["one"]).damper
    monkeypatch.setattr(best, "within_reach", lambda fit, *_: fit)
    free = identify_best(campaigns["one"]).damper
    own, others = ([fit_percent(d, campaigns[n].runs) for d in (within, free)] for n in ("one", "others"))
    assert own[0] > own[1] - 1.5
    assert others[0] > 80.0
    assert others[0] > others[1] + 30.0


@pytest.mark.parametrize("hz", [1.0, 1.5])
def test_a_slow_pole_that_is_true_is_kept(hz: float) -> None:
    damper = replace(random_damper(4), forward_filter=filter_with(hz, 1.6 * hz))
    bench = Bench(damper, np.random.default_rng(7))
    runs = [
        [bench.sine(f"{i:g}A", 1000.0, 5.0, 8e-3, 20, i, 30.0) for i in (0.0, 1.0, 2.0, 3.0)]
        for _ in range(2)
    ]
    training, held_out = (records_of(r) for r in runs)
    assert slowest_motion_hz(training) > 3.5
    fit = fit_base(training)
    assert fit.model.on(held_out).rmse_n(fit.theta) <= 1.05 * NOISE_N


def test_a_pole_below_all_motion_needs_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(replace(random_damper(4), forward_filter=filter_with(1.0, 1.6)), np.random.default_rng(7))
    training = records_of([bench.sine("run", 1000.0, 5.0, 8e-3, 20, 2.0, 30.0)])
    monkeypatch.setattr(slow_poles, "GRANTED_NOISE", 1e9)
    monkeypatch.setattr(slow_poles, "GRANTED", 1e9)
    fit = fit_base(training)
    low_hz = slow_poles.SLOWER * slowest_motion_hz(training)
    assert fit.model.slowest_pole == pytest.approx(low_hz * 2 * np.pi / hysteresis.UNIT_RAD_S)
    assert slowest_hz(fit) >= 0.99 * low_hz


def test_the_slowest_motion_is_that_of_the_slowest_run() -> None:
    assert 3.0 < slowest_motion_hz(sines(4.0)) <= 4.0
    assert 0.0 < slowest_motion_hz(sines(4.0) + sines(0.5)) <= 0.5
