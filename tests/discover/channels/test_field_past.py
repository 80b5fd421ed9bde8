"""A field keeps what was on before a run began, which no file tells; a run's own course shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from discover.campaigns import picked
from hidden import NOISE_N, RATE_HZ, bench_of, few, rich

from mrctl.discover.channels.field_past import fields_past
from mrctl.discover.evidence import Evidence
from mrctl.discover.search.rounds import rounds_of
from mrctl.discover.taken_anew import remembered
from mrctl.model.effects.registry import effects
from mrctl.simulate import stages

LOOP = {"half_width_a": 0.15, "share": 1.0, "smoothness": 0.0}


def _after_a_fall(campaign):
    """The campaign, its last run begun where the current has just come down."""
    *others, run = campaign.runs
    falls = np.flatnonzero(np.diff(run.current_a) < -0.2)
    return replace(campaign, runs=(*others, picked(run, slice(falls[0] + 1, None))))


def test_a_run_that_begins_after_a_larger_current_is_told_from_the_others():
    campaign = _after_a_fall(rich({"magnetic_hysteresis": LOOP}))
    evidence = Evidence.of(campaign)
    effect = effects()["magnetic_hysteresis"]
    proof = evidence.base([effect], {effect.name: tuple(LOOP.values())})
    after, better = remembered(evidence, proof)
    assert [r.before_a for r in after.measured] == [0.0] * (len(after.measured) - 1) + [3.0]
    assert [r.before_a for r in after.records] == [r.before_a for r in after.full]
    assert better.mean_square < 1.2 * NOISE_N**2 < 0.5 * proof.mean_square
    assert better.fit.effect_values[effect.name][0] == pytest.approx(LOOP["half_width_a"], rel=0.05)


def test_a_past_between_is_told_where_the_current_came_down_by_less_than_the_loop_is_wide():
    campaign = few(rich({"magnetic_hysteresis": LOOP}))
    run = campaign.runs[-1]
    bench = bench_of({"magnetic_hysteresis": LOOP}, 2)
    second = int(RATE_HZ)
    current = np.where(np.arange(run.time_s.size) < second, 1.5 + 0.12, 1.5)
    later = picked(
        bench.run("after", run.time_s, run.velocity_m_s, current, 30.0), slice(second + second // 2, None)
    )
    evidence = Evidence.of(replace(campaign, runs=(*campaign.runs, later)))
    effect = effects()["magnetic_hysteresis"]
    proof = evidence.base([effect], {effect.name: tuple(LOOP.values())})
    after, better = remembered(evidence, proof)
    *others, last = (r.before_a for r in after.measured)
    assert not any(others)
    assert last == pytest.approx(1.62, abs=0.03)
    # Its width, which made up for what was missing of that, has come along.
    assert better.fit.effect_values[effect.name][0] == pytest.approx(LOOP["half_width_a"], rel=0.03)
    assert better.mean_square < 1.2 * NOISE_N**2 < 0.9 * proof.mean_square


@pytest.mark.long
def test_a_search_goes_on_from_runs_with_their_pasts():
    """Else a second effect makes up for a run that begins wrong."""
    evidence = Evidence.of(_after_a_fall(few(rich({"magnetic_hysteresis": LOOP}))))
    known = [effects()[name] for name in ("magnetic_hysteresis", "self_heating")]
    after, levels, found, _, _ = rounds_of(evidence, evidence.base(), known, lambda *_: None)
    assert [t.effect.name for t in found] == ["magnetic_hysteresis"]
    assert after.measured[-1].before_a == 3.0
    assert len(levels) == 1  # and nothing is left to search


def test_where_nothing_remembers_there_is_no_past():
    campaign = _after_a_fall(rich({"current_lag": {"rise_time_s": 0.02, "fall_time_s": 0.02}}))
    evidence = Evidence.of(campaign)
    lag = effects()["current_lag"]
    for chosen in ([], [lag]):
        fit = evidence.base(chosen, {lag.name: (0.02, 0.02, 0.0)}).fit
        assert fields_past(fit.model.on(evidence.full), fit.theta) is None


def test_a_coil_has_forgotten_by_then_and_a_field_has_not():
    current = np.full(50, 1.0)

    def made(name, p, before):
        return stages.field_current([(effects()[name], p)], current, 0.001, before_a=np.array([before]))

    assert np.allclose(made("current_lag", (0.02, 0.02, 0.0), 3.0), 1.0)
    assert np.allclose(made("magnetic_hysteresis", tuple(LOOP.values()), 0.0), 1.0 - 0.15)
    assert np.allclose(made("magnetic_hysteresis", tuple(LOOP.values()), 3.0), 1.0 + 0.15)
