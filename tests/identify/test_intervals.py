"""How sure a fit is of its parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from discover.hidden import rich

from mrctl.identify.best import fit_base
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import weighed_as
from mrctl.identify.records import records_of
from mrctl.model.effects.registry import effects

DELAY_S = 1.7e-3


def _delayed() -> JointFit:
    records = [r.decimated(2) for r in records_of(rich({"sensor_delay": {"delay_s": DELAY_S}}).runs)]
    base = fit_base(records)
    model = JointModel(base.model.layout, records, Effects((effects()["sensor_delay"],)), minimum_phase=True)
    theta = model.pack(base.tables, {"sensor_delay": (DELAY_S,)})
    model.reweigh(theta)
    return model.fit(theta, penalties=weighed_as(base.penalties, model.penalties()), rounds=1, iterations=10)


def test_a_filter_at_its_bounds_makes_nothing_surer():
    fit = _delayed()
    part = fit.model.layout.parts["filter"]
    held = fit.solution.held.copy()
    held[part] = True
    at_bounds = replace(fit, solution=replace(fit.solution, held=held))
    (std,) = fit.effect_std()["sensor_delay"]
    assert at_bounds.effect_std()["sensor_delay"][0] == std
    assert np.isfinite(std)
    assert std > 0.0
    assert abs(fit.effect_values["sensor_delay"][0] - DELAY_S) < 3.0 * std


def test_runs_that_disagree_make_a_parameter_as_unsure_as_fits_without_one_or_the_other_do():
    gains = np.random.default_rng(5).normal(1.0, 0.02, 64)  # each run's own, which no parameter is
    viscous = {"damping_n_s_m": 300.0, "thinning_per_k": 0.0, "lag_s": 0.0, "easing_per_k": 0.0}
    runs = rich({"viscous_damping": viscous}).runs
    records = [r.decimated(2) for r in records_of(runs)]
    records = [replace(r, force_n=g * r.force_n) for r, g in zip(records, gains, strict=False)]
    base = fit_base(records)
    effect = effects()["viscous_damping"]
    model = JointModel(base.model.layout, records, Effects((effect,)), minimum_phase=True)
    theta = model.pack(base.tables, {effect.name: (300.0, 0.0, 0.0, 0.0)})
    model.reweigh(theta)
    penalties = weighed_as(base.penalties, model.penalties())
    fit = model.fit(theta, penalties=penalties, rounds=1, iterations=10)

    def without(k: int) -> float:
        less = model.on([r for n, r in enumerate(records) if n != k])
        less.weights, less.noise_n = np.delete(model.weights, k), np.delete(model.noise_n, k)
        return less.fit(fit.theta, penalties=penalties, rounds=1, iterations=10).effect_values[effect.name][0]

    values = np.array([without(k) for k in range(len(records))])
    std = fit.effect_std()[effect.name][0]
    assert 0.7 < std / np.sqrt((len(records) - 1) * np.var(values)) < 1.4
    alike = replace(fit, model=model.on(records[:3]))  # too few to disagree: what noise alone would do
    alike.model.weights = model.weights[:3]
    assert np.isfinite(alike.effect_std()[effect.name][0])
