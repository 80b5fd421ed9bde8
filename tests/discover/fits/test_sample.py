"""Enough data to choose by: of many records some, of long ones pieces, unless warmth has to be remembered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrctl.discover.fits import sample
from mrctl.discover.fits.sample import as_all_say, sampled
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


def _slow_and_fast() -> tuple[JointFit, JointModel]:
    """A fit to all records, and its model on one that says nothing of speeds above a tenth of theirs."""
    slow = _record(0, 4.0)
    v = 0.1 * slow.velocity_m_s
    noise = 5.0 * np.random.default_rng(9).normal(size=v.size)
    force = (200.0 + 500.0 * slow.current_a) * np.tanh(v / 0.05) + noise
    fit = _fit([replace(slow, velocity_m_s=v, force_n=force), _record(1, 4.0), _record(2, 4.0)])
    some = fit.model.on(fit.model.records[:1])
    some.weights, some.noise_n = fit.model.weights[:1], fit.model.noise_n[:1]
    return fit, some


def test_what_some_records_say_little_of_stays_as_all_have_it():
    fit, some = _slow_and_fast()
    begin = fit.theta.copy()
    begin[fit.model.layout.parts["f"]] *= 1.1
    ends = [
        some.fit(begin, penalties=[*fit.penalties, *hold], rounds=1, iterations=8).theta
        for hold in ([], [as_all_say(fit, fit.theta)])
    ]
    free, held = (fit.model.cost(theta) - fit.model.cost(fit.theta) for theta in ends)
    assert held < 0.1 * free
    assert some.cost(ends[1]) < 1.05 * some.cost(ends[0])


def test_the_hold_is_as_firm_as_the_records_make_it_and_none_where_it_is():
    fit, _ = _slow_and_fast()
    hold = as_all_say(fit, np.append(fit.theta, [3.0, 4.0]))
    step = np.zeros(fit.theta.size + 2)
    assert hold.excess(np.append(fit.theta, [8.0, -1.0])) < 1e-12
    step[fit.model.layout.parts["f"]] = 1e-3
    moved = fit.theta + step[:-2]
    there = hold.excess(np.append(moved, [0.0, 0.0]))
    assert there == pytest.approx(step[:-2] @ fit.solution.normal.matrix @ step[:-2], rel=1e-6)


def test_a_hold_whatever_h_may_be_lets_h_go():
    warm = [replace(_record(k, 4.0), temperature_c=np.linspace(20.0, 60.0, 2000)) for k in range(3)]
    fit = _fit(warm)
    parts = fit.model.layout.parts
    assert parts["h_on"].stop > parts["h_on"].start
    theta = fit.theta.copy()
    theta[parts["h_on"]] += 0.1
    firm, loose = (as_all_say(fit, fit.theta, warmth=warmth).excess(theta) for warmth in (True, False))
    assert loose < 1e-6 * firm
