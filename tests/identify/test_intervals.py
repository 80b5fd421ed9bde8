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
