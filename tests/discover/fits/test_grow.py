"""Models with one effect more or less, and the other valleys that their fits are begun in."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from discover.hidden import rich

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.grow import grown_by
from mrctl.discover.fits.proof import prove
from mrctl.discover.fits.refit import fitted
from mrctl.discover.fits.settle import WARMER, settled, warmer, without
from mrctl.discover.search.exchange import exchanged
from mrctl.discover.search.renewed import renewed
from mrctl.identify.base import Rows
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.model.effects.registry import effect

SPRING = (0.0, 4000.0, 0.0, 0.0)
CAVITATION = effect("cavitation")


@pytest.fixture(scope="module")
def sprung():
    """The evidence of a damper with a gas spring, the base beside it, and the model with the spring."""
    campaign = rich({"gas_spring": {"preload_n": 0.0, "stiffness_n_m": 4000.0, "progression_per_m": 0.0}})
    evidence = Evidence.of(replace(campaign, runs=campaign.runs[:8]))
    base = evidence.base()
    return evidence, base, prove(grown_by(base.fit, effect("gas_spring"), SPRING), evidence.folds)


def test_tables_are_smoothed_anew_once_the_error_has_gone(sprung):
    evidence, base, first = sprung
    again = settled(first, evidence.folds)
    assert first.mean_square < 0.5 * base.mean_square
    assert again.mean_square <= first.mean_square
    assert np.mean(again.fit.model.noise_n**2) < 0.5 * np.mean(first.fit.model.noise_n**2)
    assert settled(again, evidence.folds) is again


def test_a_fit_whose_slopes_are_beyond_all_numbers_foretells_nothing(sprung, monkeypatch):
    evidence, base, first = sprung
    finite = JointModel.jacobians

    def endless(model, theta):
        for rest, rows in finite(model, theta):
            yield rest, Rows(np.full_like(rows.values, np.nan), rows.index)

    monkeypatch.setattr(JointModel, "jacobians", endless)
    lost = prove(first.fit, evidence.folds)
    assert lost.fit is first.fit
    assert lost.mean_square == pytest.approx(first.mean_square, rel=1e-3)
    assert np.all(np.isfinite(lost.held_out))
    assert not lost.predicts_better_than(base)


def test_less_an_effect_the_force_is_that_of_its_neutral_parameters(sprung):
    fit = sprung[2].fit
    neutral = np.concatenate([fit.theta[: fit.model.layout.size], np.zeros(len(SPRING))])
    bare = fit.less({"gas_spring"})
    for force, less in zip(fit.model.predict(neutral), bare.model.predict(bare.theta), strict=True):
        np.testing.assert_allclose(less, force, atol=1e-6)
    assert bare.solution.held.size == bare.theta.size == bare.model.size
    assert all(p.rows.shape[1] == bare.theta.size for p in bare.penalties)
    assert [p.weight for p in bare.penalties if p.adapts] == [p.weight for p in fit.penalties if p.adapts]


def test_a_fluid_that_warms_up_is_begun_warmer_too_with_a_straight_h(sprung):
    base = sprung[1].fit
    layout = base.model.layout
    model = base.model.with_effects(Effects((effect("gas_spring"), effect("self_heating"))))
    values = {"gas_spring": SPRING, "self_heating": (2e-3, 90.0, 2.0, 1.5)}
    theta = np.concatenate([base.theta, model.effects.pack(values)])
    bent = layout.parts["h_on"]
    theta[bent] = np.where(np.arange(layout.free_h.size) % 2, 0.3, -0.3)
    starts = warmer(SimpleNamespace(model=model, theta=theta))
    assert len(starts) == len(WARMER)
    for start, times in zip(starts, WARMER, strict=True):
        own = model.effect_values(start)
        assert own["gas_spring"] == pytest.approx(SPRING)
        assert own["self_heating"] == pytest.approx((2e-3 * times, 90.0, 2.0, 1.5 * times))
        slope = start[bent] / (layout.temperature_c[layout.free_h] - layout.temperature_c[layout.reference])
        np.testing.assert_allclose(slope, slope[0])
        np.testing.assert_array_equal(start[: bent.start], theta[: bent.start])
    assert warmer(SimpleNamespace(model=base.model, theta=base.theta)) == []


def test_what_is_missing_takes_the_place_of_what_stood_in_for_it_and_not_the_other_way(sprung):
    evidence, base, with_spring = sprung
    stand_in = prove(grown_by(base.fit, effect("fluid_inertia"), (3.0, 0.0)), evidence.folds)
    both = prove(grown_by(stand_in.fit, effect("gas_spring"), SPRING), evidence.folds)
    spring = SimpleNamespace(effect=effect("gas_spring"), proof=both, parameters=2)
    inertia = SimpleNamespace(effect=effect("fluid_inertia"), proof=both, parameters=2)
    proof, gone = exchanged(stand_in, spring, [inertia], evidence.folds)
    assert gone is inertia
    assert [e.name for e in proof.fit.model.effects.chosen] == ["gas_spring"]
    assert proof.mean_square == pytest.approx(with_spring.mean_square, rel=0.05)
    assert exchanged(with_spring, inertia, [spring], evidence.folds) is None


def test_what_an_effect_could_not_show_beside_another_it_shows_without_it(sprung):
    evidence, base, _ = sprung
    pushed = [replace(r, force_n=r.force_n + 60.0) for r in evidence.records]
    model = base.fit.model.on(pushed).with_effects(Effects((effect("force_offset"), effect("gas_spring"))))
    theta = np.concatenate(
        [base.fit.theta, model.effects.pack({"force_offset": (0.0,), "gas_spring": SPRING})]
    )
    free = model.free()
    preload = model.layout.size + 1
    free[preload] = False  # as it is found beside a constant force, from which nothing tells it
    fit = model.fit(theta, free=free, rounds=1, iterations=20, tolerance=1e-4)
    both = prove(fit, evidence.folds)
    assert fit.effect_values["gas_spring"][0] == 0.0
    spring = without(both, "force_offset", evidence.folds)
    assert spring.fit.effect_values["gas_spring"][0] == pytest.approx(60.0, abs=10.0)
    assert spring.mean_square == pytest.approx(both.mean_square, rel=0.02)


def test_an_effect_that_is_stuck_is_begun_anew(sprung):
    evidence, _, with_spring = sprung
    fit = with_spring.fit
    at_its_bound = {"gas_spring": (0.0, 300.0, -60.0, 0.0)}
    theta = fit.model.pack(fit.tables, at_its_bound)
    there = fit.model.fit(theta, penalties=fit.penalties, free=fit.moving, rounds=1, iterations=1)
    stuck = prove(there, evidence.folds)
    assert stuck.mean_square > 2.0 * with_spring.mean_square
    anew = renewed(stuck, [effect("gas_spring")], evidence.folds)
    assert anew.mean_square == pytest.approx(with_spring.mean_square, rel=0.05)
    again = renewed(anew, [effect("gas_spring")], evidence.folds)
    assert again.mean_square == pytest.approx(anew.mean_square, rel=0.01)


def test_a_look_at_the_bounds_keeps_no_effect_from_its_place():
    """A base's slopes reach no force without compression: what settles so costs far more than no effect."""
    changed = {"compression_change": -0.2, "compression_change_per_a": 0.1, "bend_per_a": 0.0}
    campaign = rich({"rebound_asymmetry": changed})
    evidence = Evidence.of(replace(campaign, runs=campaign.runs[:8]))
    base = evidence.base()
    fit = grown_by(base.fit, effect("rebound_asymmetry"), (0.0, -50.0, 0.0, -500.0, 1.0, 0.0))
    assert fit.total < 0.5 * base.fit.total


def test_runs_that_fit_badly_are_not_weighed_down_where_an_effect_is_added():
    """A limit that few runs reach: each run weighed by its own error, the fit would rather have none."""
    limited = {p.name: v for p, v in zip(CAVITATION.parameters, CAVITATION.neutral, strict=True)}
    campaign = rich({"cavitation": limited | {"limit_n": 900.0, "knee_n": 80.0}})
    base = fitted(Evidence.of(campaign).records, (), {})
    assert base.model.noise_n.max() > 2.0 * base.model.noise_n.min()
    assert grown_by(base, CAVITATION).effect_values["cavitation"][0] == pytest.approx(900.0, rel=0.05)
