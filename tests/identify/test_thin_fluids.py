"""What h is taken to be where no run decides it: what fluids usually do, no steeper."""

import numpy as np
import pytest

from mrctl.identify.effects_fit import Effects
from mrctl.identify.findings import _between, _temperature
from mrctl.identify.finish import complete_tables
from mrctl.identify.joint import JointModel
from mrctl.identify.records import Record
from mrctl.identify.start import as_warm_as_measured, layout_for, start_values
from mrctl.model.effects.registry import effect

RATE_HZ = 200.0


def _records(temperatures_c, by_k):
    """Runs at these temperatures, of a force that warmth changes by that share a kelvin."""
    t = np.arange(400) / RATE_HZ
    noise = np.random.default_rng(5)
    found = []
    for k, at_c in enumerate(temperatures_c):
        v = 0.3 * np.sin(2.0 * np.pi * (1.0 + 0.3 * k) * t)
        force = 800.0 * np.tanh(v / 0.05) * np.exp(by_k * (at_c - 24.0)) + noise.normal(0.0, 8.0, t.size)
        flat = np.ones(t.size)
        found.append(Record(k, RATE_HZ, v, flat, at_c * flat, force, flat, flat))
    return found


def _warm(records, layout):
    return JointModel(layout, records, Effects((effect("self_heating"),)))


def _h(records, layout):
    cold, model = JointModel(layout, records), _warm(records, layout)
    begin = np.concatenate([start_values(cold), model.neutral()[layout.size :]])
    free = model.free()
    free[layout.size :] = False  # no fluid warms: h alone is asked
    return layout.unpack(model.fit(begin, free=free).theta).h_on


def test_where_no_run_is_warm_a_warm_fluid_is_taken_to_be_as_thin_as_fluids_are():
    records = _records([24.0, 24.0], 0.0)  # half a kelvin apart, their noise would say how h goes on
    layout = layout_for(records, order=1, warmer_k=60.0)
    fall = -np.log(_h(records, layout)[-1])
    assert 0.5 < fall / (0.005 * np.ptp(layout.temperature_c)) < 1.0  # between that and no change


@pytest.mark.parametrize("by_k", [-0.03, 0.004])
def test_where_runs_are_warm_h_is_what_they_say(by_k):
    records = _records([24.0, 40.0, 56.0], by_k)
    layout = layout_for(records, order=1)
    assert _h(records, layout) == pytest.approx(np.exp(by_k * (layout.temperature_c - 24.0)), rel=0.01)


@pytest.mark.parametrize("cases_c", [[24.0, 28.0], [24.0, 25.0, 29.0, 31.0, 50.0], [24.0, 24.5]])
def test_knots_for_a_warm_fluid_stand_apart(cases_c):
    """Between two that crowd each other a steep h would stand in for the fluid's rise."""
    records = _records(cases_c, 0.0)
    knots_c = layout_for(records, order=1, warmer_k=60.0).temperature_c
    assert np.diff(knots_c).min() >= 7.5
    assert knots_c[0] == pytest.approx(24.0, abs=0.6)
    assert knots_c[-1] == pytest.approx(max(cases_c) + 60.0, abs=0.3)


def test_the_pull_to_what_fluids_do_is_that_of_one_observation():
    """It must not outweigh runs: a slope of twice the usual spread costs as two standard deviations do."""
    layout = layout_for(_records([24.0, 40.0], 0.0), order=1)
    model = _warm(_records([24.0, 40.0], 0.0), layout)
    theta = model.neutral()
    theta[layout.parts["h_on"]] = 16.0 * (-0.005 + 2.0 * 0.01)
    pull = next(p for p in model.penalties() if p.name == "h_on thins")
    assert pull.weight * pull.excess(theta) == pytest.approx(4.0)
    assert not pull.adapts


def test_a_model_whose_fluid_is_no_warmer_than_measured_is_left_alone():
    records = _records([24.0, 40.0], 0.0)
    names = {p.name for p in JointModel(layout_for(records, order=1), records).penalties()}
    assert not {"h_on thins", "h_off thins"} & names


def test_without_an_effect_that_warms_the_fluid_h_ends_where_the_case_was():
    records = _records([24.0, 40.0], -0.005)
    warm, plain = (layout_for(records, order=1, warmer_k=rise_k) for rise_k in (60.0, 0.0))
    assert np.array_equal(as_warm_as_measured(warm, records).temperature_c, plain.temperature_c)
    assert as_warm_as_measured(plain, records) is plain
    alone = _records([24.0, 24.0], 0.0)
    assert as_warm_as_measured(layout_for(alone, order=1, warmer_k=60.0), alone).temperature_c.size == 1


def _off_and_on(off_c):
    """All currents at one temperature, one of them at three, none at these; h is alike with and without."""
    t = np.arange(800) / RATE_HZ
    noise, found = np.random.default_rng(7), []
    conditions = [(i, 40.0) for i in (0.5, 1.0, 1.5, 2.0)] + [(1.0, 24.0), (1.0, 56.0)]
    conditions += [(0.0, c) for c in off_c]
    for k, (current_a, at_c) in enumerate(conditions):
        v = 0.3 * np.sin(2.0 * np.pi * (1.0 + 0.1 * k) * t)
        level = (200.0 + 900.0 * np.tanh(current_a / 1.2)) * np.exp(-0.004 * (at_c - 24.0))
        force = level * np.tanh(v / 0.05) + noise.normal(0.0, 3.0, t.size)
        flat = np.ones(t.size)
        found.append(Record(k, RATE_HZ, v, current_a * flat, at_c * flat, force, flat, flat))
    return found


@pytest.mark.parametrize("off_c", [[40.0], [24.0, 40.0, 56.0]])
def test_where_no_run_is_without_current_h_off_is_near_h_on(off_c):
    """And f without current is what makes the one that was measured."""
    records = _off_and_on(off_c)
    model = JointModel(layout_for(records, order=1), records)
    fit = model.fit(start_values(model))
    tables = fit.tables
    assert tables.h_off == pytest.approx(tables.h_on, rel=0.015)
    assert tables.f[0] * tables.h_off[1] == pytest.approx(200.0 * np.exp(-0.004 * 16.0), rel=0.01)
    near = [one for one in _temperature(fit) if "24, 56 degC" in one.what]
    assert len(near) == (len(off_c) == 1)


def test_that_no_run_without_current_was_warmer_than_the_case_is_nothing_to_tell():
    records = _off_and_on([24.0, 40.0, 56.0])
    model = JointModel(layout_for(records, order=1, warmer_k=60.0), records)
    assert model.layout.temperature_c[-1] > 100.0
    assert _temperature(model.fit(start_values(model), rounds=1)) == []


@pytest.mark.parametrize(("cases_c", "by_k"), [([24.0, 64.0], -0.008), ([10.0, 24.0, 60.0], 0.004)])
def test_between_temperatures_far_apart_h_changes_by_one_share_a_degree(cases_c, by_k):
    """A chord would be off by what (by_k gap)^2 / 8 says, 1.3 and 0.3 %, in its middle."""
    records = _records(cases_c, by_k)
    layout = layout_for(records, order=1)
    model = JointModel(layout, records)
    fit = model.fit(start_values(model))
    written = complete_tables(layout, fit.tables)
    middle_c = 0.5 * (cases_c[-2] + cases_c[-1])
    made = np.interp([cases_c[-2], middle_c, cases_c[-1]], written.temperature_c, written.h_on)
    assert made[1] == pytest.approx(np.sqrt(made[0] * made[2]), rel=2e-3)
    assert set(layout.temperature_c) <= set(written.temperature_c)
    assert len(written.h_off) == len(written.h_on) == len(written.temperature_c)
    (told,) = _between(layout.temperature_c)
    assert f"between {cases_c[-2]:.0f} and {cases_c[-1]:.0f} degC" in told.what


def test_temperatures_at_hand_are_written_as_they_were_fitted():
    records = _records([24.0, 38.0, 52.0], -0.005)
    model = JointModel(layout_for(records, order=1), records)
    fit = model.fit(start_values(model))
    written = complete_tables(model.layout, fit.tables)
    assert written.temperature_c == pytest.approx(model.layout.temperature_c)
    assert written.h_on == pytest.approx(fit.tables.h_on)
    assert _between(model.layout.temperature_c) == []
