"""Records at another rate than they were measured at: what counts of them, and which may be thinned."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrctl.discover.fits.refit import HELD_OUT_SHARE, split
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.records import SLOWEST_HZ, Record, records_of
from mrctl.identify.start import layout_for, start_values
from mrctl.model.effects.registry import effect

sys.path.insert(0, str(Path(__file__).parent))
from virtual import Bench, protocol, random_damper

FINER = 3
RATE_HZ = 200.0


@pytest.fixture(scope="module")
def campaign():
    return protocol("several frequencies", Bench(random_damper(5), np.random.default_rng(5)))


def test_only_what_was_measured_counts(campaign):
    record = records_of(campaign.runs)[3].refined(FINER)
    between = np.arange(len(record)) % FINER != 0
    spoilt = replace(record, force_n=np.where(between, record.force_n + 500.0, record.force_n))
    plain, other = (JointModel(layout_for([record], 3), [r]) for r in (record, spoilt))
    theta = start_values(plain)
    assert other.cost(theta) == plain.cost(theta) > 0.0
    assert other.rmse_n(theta) == plain.rmse_n(theta)
    (ours, rows), (theirs, _) = next(iter(plain.jacobians(theta))), next(iter(other.jacobians(theta)))
    assert np.array_equal(ours, theirs)
    assert rows.values.shape[1] == ours.size <= len(record) // FINER


def test_a_record_is_cut_where_a_sample_was_measured(campaign):
    first = replace(campaign, runs=campaign.runs[:1])
    measured = records_of(first.runs)
    parts = split(first, [r.refined(FINER) for r in measured])
    (training,), (held_out,), (begins,) = parts.training, parts.held_out, parts.begins
    assert begins == len(training)
    assert begins % FINER == 0
    assert (len(held_out) - begins) / begins == pytest.approx(1.0 / (HELD_OUT_SHARE - 1), rel=0.01)
    assert held_out.force_n[:begins:FINER] == pytest.approx(training.force_n[::FINER])
    assert held_out.force_n[::FINER] == pytest.approx(measured[0].force_n)


def _moving(amplitude_m_s: float, hz: float, current_a: float | np.ndarray = 1.0) -> Record:
    t = np.arange(4000) / RATE_HZ
    v = amplitude_m_s * np.sin(2.0 * np.pi * hz * t)
    flat = np.zeros(t.size)
    return Record(0, RATE_HZ, v, flat + current_a, flat, flat, flat, flat)


@pytest.mark.parametrize(
    ("amplitude_m_s", "hz", "slow"), [(0.015, 0.1, 4), (0.3, 1.0, 1), (0.04, 0.25, 2), (0.0, 1.0, 4)]
)
def test_only_a_motion_that_hardly_changes_in_a_sample_is_thinned(amplitude_m_s, hz, slow):
    record = _moving(amplitude_m_s, hz)
    assert record.slow == slow
    assert record.decimated(slow).rate_hz >= SLOWEST_HZ


def test_a_run_whose_current_changes_is_never_thinned():
    assert _moving(0.015, 0.1, np.linspace(0.0, 1.0, 4000)).slow == 1


@pytest.mark.parametrize(
    ("phase", "ramp_s", "rest"), [(0.0, 0.5, True), (0.0, 0.0, False), (1.0, 0.0, False)]
)
def test_a_record_cut_where_its_motion_turns_does_not_start_at_rest(phase, ramp_s, rest):
    t = np.arange(800) / RATE_HZ
    v = np.sin(2.0 * np.pi * 3.0 * t + phase) * (np.clip(t / ramp_s, 0.0, 1.0) if ramp_s else 1.0)
    flat = np.zeros(t.size)
    assert Record(0, RATE_HZ, v, flat, flat, flat, flat, flat).starts_at_rest is rest


def test_a_sweep_that_grows_does_not_start_at_rest_where_it_turns():
    t = np.arange(4000) / RATE_HZ
    v = -(0.02 + 0.06 * t / t[-1]) * np.sin(2.0 * np.pi * 4.0 * t)
    flat = np.ones(t.size)
    assert not Record(0, RATE_HZ, v, flat, flat, 600.0 * np.tanh(v / 0.05), flat, flat).starts_at_rest


def test_a_record_whose_force_is_still_falling_does_not_start_at_rest():
    t = np.arange(0.0, 5.0, 1.0 / RATE_HZ)
    v = 0.4 * np.sin(2.0 * np.pi * t) * np.minimum(t, 1.0)
    flat, settling = np.ones(t.size), 600.0 * np.tanh(v / 0.05) + 700.0 * np.exp(-t / 0.005)
    assert Record(0, RATE_HZ, v, flat, flat, 600.0 * np.tanh(v / 0.05), flat, flat).starts_at_rest
    assert not Record(0, RATE_HZ, v, flat, flat, settling, flat, flat).starts_at_rest


def test_a_record_too_short_to_tell_does_not_start_at_rest():
    two = np.array([0.0, 0.1])
    assert not Record(0, RATE_HZ, two, two, two, two, two, two).starts_at_rest


def test_noise_does_not_say_to_which_side_a_record_that_starts_at_rest_has_yielded():
    t = np.arange(800) / RATE_HZ
    v = 0.3 * np.sin(2.0 * np.pi * 3.0 * t) * np.clip(t / 0.5, 0.0, 1.0)
    flat = np.ones(t.size)
    elastic = effect("preyield_stiffness")
    values = [elastic.typical[k] if p.name != "plastic" else 1.0 for k, p in enumerate(elastic.parameters)]

    def begun(first: float, second: float) -> Record:
        noisy = np.concatenate([[first, second], v[2:]])
        return Record(0, RATE_HZ, noisy, flat, flat, 600.0 * np.tanh(v / 0.05), flat, flat)

    one, other = begun(1e-4, -1e-4), begun(-1e-4, 1e-4)
    assert one.starts_at_rest
    assert other.starts_at_rest
    model = JointModel(layout_for([one], 3), [one, other])
    both = model.with_effects(Effects((elastic,)))
    theta = np.concatenate([start_values(model), both.effects.pack({elastic.name: tuple(values)})])
    forces = both.predict(theta)
    assert forces[0] == pytest.approx(forces[1], abs=1.0)
    assert abs(forces[0][0]) < 1.0
    aside = begun(1e-4, 2e-4)  # to one side only, but its force is next to none
    assert aside.starts_at_rest
    assert aside.driven_m_s[0] == 0.0
    moving = replace(aside, force_n=np.concatenate([[200.0], aside.force_n[1:]]))
    assert np.array_equal(moving.driven_m_s, moving.velocity_m_s)  # slowly, and to one side
