"""Runs that differ in scale: how far, and that a fit is not bent by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from discover.hidden import rich

from mrctl.discover.fits.refit import fitted, thinned
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.records import records_of
from mrctl.identify.run_scatter import LEAST, ScatteredModel, scale_spread
from mrctl.model.effects.registry import effect

ELASTIC = {"yield_length_m": 5e-4, "compliance_m_n": 0.0, "creep": 0.0}
SPREAD = 0.04


@pytest.fixture(scope="module")
def records():
    """A damper that is elastic before it yields, and another one each run."""
    random = np.random.default_rng(4)
    runs = rich({"preyield_stiffness": ELASTIC | {"share": 1.0}}).runs[:12]
    return thinned(
        records_of([replace(r, force_n=r.force_n * (1.0 + SPREAD * random.normal())) for r in runs])
    )


def test_the_spread_is_that_of_the_scales():
    random = np.random.default_rng(1)
    force = [800.0 * np.sin(np.linspace(0.0, 40.0, 900) + k) for k in range(40)]
    errors = [SPREAD * random.normal() * f + random.normal(0.0, 20.0, f.size) for f in force]
    assert scale_spread(errors, force) == pytest.approx(SPREAD, rel=0.3)
    assert scale_spread(errors[:4], force[:4]) == 0.0


def test_noise_alone_is_no_scatter():
    random = np.random.default_rng(2)
    force = [800.0 * np.sin(np.linspace(0.0, 40.0, 900) + k) for k in range(12)]
    for _ in range(20):
        assert scale_spread([random.normal(0.0, 20.0, f.size) for f in force], force) == 0.0


def test_the_cost_is_that_of_the_covariance(records):
    few = records[:2]
    base = fitted(few, (), {})
    model = ScatteredModel(base.model.layout, few, Effects(()))
    model.weigh_as(base.model)
    model.spread = SPREAD
    model.levels = [model.weighed(r, f) for r, f in zip(few, model.predict(base.theta), strict=True)]
    wanted = 0.0
    for k, rest in enumerate(model.residuals(base.theta)):
        along = model.levels[k][-rest.size :]
        covariance = np.eye(rest.size) / model.weights[k] + SPREAD**2 * np.outer(along, along)
        wanted += 0.5 * float(rest @ np.linalg.solve(covariance, rest))
    assert model.cost(base.theta) == pytest.approx(wanted, rel=1e-6)
    assert model.normal(base.theta).cost == pytest.approx(wanted, rel=1e-6)


def test_shapes_are_not_bent_to_make_up_for_it(records):
    chosen = (effect("preyield_stiffness"),)
    free = {"preyield_stiffness": [True, True, True, True, True, True, True, False, False, False]}
    begin = {"preyield_stiffness": (1e-3, 0.0, 0.3, 0.8, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0)}
    fit = fitted(records, chosen, begin, free=free)
    assert isinstance(fit.model, ScatteredModel)
    assert LEAST < fit.model.spread < 1.5 * SPREAD  # f takes up what the runs of one current share
    length, compliance = fit.effect_values["preyield_stiffness"][:2]
    assert length + 1000.0 * compliance == pytest.approx(5e-4, rel=0.1)


def test_runs_alike_are_fitted_as_ever():
    same = thinned(records_of(rich().runs[4:12]))
    chosen = (effect("force_offset"),)
    fit = fitted(same, chosen, {"force_offset": (0.0,)})
    assert fit.model.spread < LEAST
    plain = JointModel(fit.model.layout, same, fit.model.effects)
    plain.weigh_as(fit.model)
    assert plain.cost(fit.theta) == pytest.approx(fit.model.cost(fit.theta), rel=1e-12)
