"""Enough data to choose by: of many records some, of long ones pieces, unless warmth has to be remembered."""

from __future__ import annotations

import numpy as np
import pytest

from mrctl.discover.fits import sample
from mrctl.discover.fits.sample import sampled
from mrctl.discover.fits.tangent import Tangent
from mrctl.identify.best import fit_base
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record
from mrctl.model.effects.registry import effects

RATE_HZ = 500.0


def _record(run: int, seconds: float, knock: slice | None = None) -> Record:
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    v = 0.2 * np.sin(9.0 * t) + 0.1 * np.sin(23.0 * t + run)
    x = -0.2 / 9.0 * np.cos(9.0 * t) - 0.1 / 23.0 * np.cos(23.0 * t + run)
    current = 1.0 + np.sin(0.7 * t + run)
    force = (200.0 + 500.0 * current) * np.tanh(v / 0.05)
    force += 5.0 * np.random.default_rng(run).normal(size=t.size)
    if knock is not None:
        force[knock] += 400.0
    return Record(run, RATE_HZ, v, current, np.full(t.size, 40.0), force, x, np.gradient(v, t))


def _fit(records: list[Record]) -> JointFit:
    return fit_base(records)


@pytest.fixture(autouse=True)
def _few_are_enough(monkeypatch):
    monkeypatch.setattr(sample, "ENOUGH", 1000)
    monkeypatch.setattr(sample, "PIECE", 250)


def test_a_long_record_counts_as_several_the_worst_of_which_is_among_them():
    fit = _fit([_record(0, 10.0, knock=slice(3000, 3200)), _record(1, 1.0)])
    few = sampled(fit.model, fit.theta)
    sizes = [len(r) for r in few.records]
    assert 1000 <= sum(sizes) <= 1500
    assert max(sizes) < 600
    long = fit.model.records[0].force_n
    begins = [int(np.flatnonzero(long == r.force_n[0])[0]) for r in few.records if r.run == 0]
    assert any(b < 3200 and b + 300 > 3000 for b in begins)
    assert np.all(few.weights == [fit.model.weights[r.run] for r in few.records])
    for r in few.records:
        if r.run == 0:
            at = int(np.flatnonzero(long == r.force_n[0])[0])
            assert np.array_equal(r.velocity_m_s, fit.model.records[0].velocity_m_s[at : at + len(r)])


def test_whole_records_stay_whole():
    fit = _fit([_record(0, 10.0), _record(1, 1.0), _record(2, 1.0)])
    few = sampled(fit.model, fit.theta, whole=True)
    assert {len(r) for r in few.records} <= {5000, 500}


def test_what_warms_up_is_looked_at_from_the_start_of_a_record():
    fit = _fit([_record(0, 10.0), _record(1, 1.0)])
    tangent = Tangent.of(fit)
    friction, heating = effects()["coulomb_friction"], effects()["self_heating"]
    assert max(len(r) for r in tangent.few(friction).records) < 600
    whole = {id(r) for r in fit.model.records}
    assert all(id(r) in whole for r in tangent.few(heating).records)
    assert tangent.glance(friction).fit.model is tangent.few(friction)
    assert tangent.glance(heating).fit.model is tangent.few(heating)


def test_records_that_are_not_long_are_taken_as_they_are():
    fit = _fit([_record(k, 1.0) for k in range(6)])
    tangent = Tangent.of(fit)
    model: JointModel = tangent.few(effects()["coulomb_friction"])
    assert model is tangent.few(effects()["self_heating"])
    assert all(len(r) == 500 for r in model.records)
    assert len(model.records) < 6
