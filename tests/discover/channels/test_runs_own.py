"""Zeros and scales of runs are told beside the tables, which make up for those of a run that goes alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from discover.campaigns import campaign, shipped, sine

from mrctl.discover.channels.run_gains import LEAST
from mrctl.discover.channels.runs_own import RunsOwn
from mrctl.discover.evidence import Evidence
from mrctl.measurements.run import Run
from mrctl.model.damper import Damper
from mrctl.simulate import simulate

SPEED_M_S = 0.1
ZEROS_N = np.array([4.0, -6.0, 3.0, -3.0, 2.0, -5.0, 30.0])
SCALES = np.array([0.008, -0.011, 0.004, -0.006, 0.012, -0.007, 0.0])


def quiet(rng, n):
    return rng.normal(0.0, 4.0, n)


def to_and_fro(damper: Damper) -> Run:
    """A run that is nearly always at one speed, as a triangle's."""
    run = sine(damper, frequency_hz=1.0, amplitude_m=0.01, current_a=1.0, name="triangle.csv")
    speed = SPEED_M_S * np.clip(8.0 * np.cos(2.0 * np.pi * run.time_s), -1.0, 1.0)
    dt_s = 1.0 / run.sample_rate_hz
    stroke = dt_s * np.cumsum(speed)
    stroke -= stroke.mean()
    force = simulate(damper, dt_s, speed, run.current_a, run.temperature_c, stroke, np.gradient(speed, dt_s))
    noise = quiet(np.random.default_rng(9), force.size)
    return replace(run, velocity_m_s=speed, displacement_m=stroke, force_n=force + noise)


def runs() -> list[Run]:
    damper = shipped()
    motions = ((1.0, 0.0, 0.04), (2.0, 0.0, 0.02), (2.0, 1.0, 0.03), (3.0, 1.0, 0.01), (1.0, 2.0, 0.06))
    sines = [
        sine(damper, frequency_hz=hz, amplitude_m=m, current_a=i, noise=quiet, name=f"{k}.csv", seed=k)
        for k, (hz, i, m) in enumerate((*motions, (3.0, 2.0, 0.02)))
    ]
    return [*sines, to_and_fro(damper)]


def told(measured: list[Run]) -> tuple[RunsOwn, np.ndarray]:
    """Of the runs of a campaign, beside its base, and the means of what that leaves."""
    evidence = Evidence.of(campaign(*measured))
    fit = evidence.base().fit
    return RunsOwn.of(fit), np.array([float(e.mean()) for e in evidence.steady_errors(fit)])


@pytest.fixture(scope="module")
def zeroed():
    return told([replace(r, force_n=r.force_n + z) for r, z in zip(runs(), ZEROS_N, strict=True)])


def test_a_zero_is_told_whole_where_a_table_made_up_for_it(zeroed):
    own, means = zeroed
    apart = own.zeros_n.values - own.zeros_n.values.mean()
    assert apart == pytest.approx(ZEROS_N - ZEROS_N.mean(), abs=3.0)
    assert means[-1] - means.mean() < 0.2 * apart[-1]


def test_they_are_sure_and_account_for_what_is_left(zeroed):
    own, _ = zeroed
    assert own.zeros_n.chance < 1e-6
    assert own.left < 0.7


def test_runs_of_one_zero_and_scale_are_alike():
    own, _ = told(runs())
    assert own.zeros_n.chance > 1e-3
    assert np.ptp(own.scales.values) < LEAST
    assert own.left > 0.97


def test_scales_are_told_up_to_what_a_current_has_in_common():
    """Two runs at each current: what both have is the table's."""
    own, _ = told([replace(r, force_n=r.force_n * (1.0 + s)) for r, s in zip(runs(), SCALES, strict=True)])
    assert own.scales.chance < 1e-6
    for a, b in ((0, 1), (2, 3), (4, 5)):
        assert own.scales.values[a] - own.scales.values[b] == pytest.approx(SCALES[a] - SCALES[b], abs=2e-3)
