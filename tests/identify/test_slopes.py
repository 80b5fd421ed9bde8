"""Every slope of the force by a parameter is what a small step of that parameter does."""

import sys
from pathlib import Path

import numpy as np
import pytest

from mrctl.identify.best import fit_base
from mrctl.identify.effects_fit import Effects
from mrctl.identify.records import records_of
from mrctl.model.effects.registry import effects

sys.path.insert(0, str(Path(__file__).parent))
from virtual import Bench, protocol, random_damper

ALIKE = 0.01  # of a slope's RMS: a knot may be crossed by the step
STEP = 1e-5
NOTHING_N = 1e-6  # a step of a parameter: less is none
ROUNDING_N = 1e-9  # of a simulated force; an effect's own slopes are differences


@pytest.fixture(scope="module")
def model():
    """A base model of a damper, on three of its runs, one of them refined."""
    bench = Bench(random_damper(2), np.random.default_rng(2))
    campaign = protocol("several frequencies", bench)
    first, *rest = records_of([campaign.runs[k] for k in (3, 6, 13)])
    return fit_base([*rest, first.refined(2)])


@pytest.mark.parametrize(
    "names",
    [
        ("mount_compliance",),
        ("mount_compliance", "coulomb_friction"),
        ("mount_compliance", "gas_spring", "rebound_asymmetry", "sensor_delay"),
        ("mount_compliance", "quadratic_damping", "force_offset", "cavitation"),
        ("mount_compliance", "viscous_damping", "off_state_backbone", "self_heating", "current_lag"),
        ("preyield_stiffness",),
        ("mount_compliance", "preyield_stiffness"),
        ("mount_compliance", "preyield_stiffness", "stroke_dependent_damping", "gas_spring", "end_stop"),
        ("current_lag", "stroke_dependent_damping"),
        ("cavitation", "self_heating"),
        ("magnetic_hysteresis", "off_state_backbone", "end_stop"),
    ],
)
def test_slopes_are_what_a_small_step_does(model, names):
    _check(model, names, {})


def test_slopes_behind_a_mount_that_hardens_and_carries_part_of_the_lag_are_as_well(model):
    _check(
        model, ("mount_compliance", "gas_spring"), {"mount_compliance": (1e-6, 1e3, 5e5, 0.4, 0.7, 0.02, 0.3)}
    )


@pytest.mark.parametrize(
    "values",
    [
        (5e-4, 1e-7, 0.5, 0.7, 0.1, 0.3, 0.3, 0.1, 0.5, 0.0),
        (5e-4, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.8),
    ],
    ids=["all of it", "a knee"],
)
def test_slopes_of_what_stretches_behind_a_mount_are_as_well(model, values):
    _check(model, ("mount_compliance", "preyield_stiffness"), {"preyield_stiffness": values})


def _check(model, names, values):
    chosen = Effects(tuple(effects()[name] for name in names))
    joint = model.model.with_effects(chosen)
    theta = np.concatenate([model.theta, chosen.pack(values)])
    before = [joint.weighed(r, f) for f, r in zip(joint.predict(theta), joint.records, strict=True)]
    slopes = list(joint.jacobians(theta))
    _, upper = joint.bounds()
    for k in range(theta.size):
        small = STEP if theta[k] + STEP <= upper[k] else -STEP
        moved = theta.copy()
        moved[k] += small
        there = joint.predict(moved)
        want, have = [], []
        for force, here, record, (_, rows) in zip(there, before, joint.records, slopes, strict=True):
            row = np.zeros(rows.values.shape[1])
            if k in rows.index:
                row = rows.values[list(rows.index).index(k)]
            have.append(row)
            want.append(((joint.weighed(record, force) - here) / small)[-row.size :])
        want, have = np.concatenate(want), np.concatenate(have)
        nothing = NOTHING_N if k < joint.layout.size else ROUNDING_N / STEP
        assert np.sqrt(np.mean((want - have) ** 2)) <= ALIKE * np.sqrt(np.mean(want**2)) + nothing, k


def test_normal_equations_are_asked_once_at_a_place_and_of_what_moves(model, monkeypatch):
    chosen = Effects((effects()["preyield_stiffness"],))
    joint = model.model.with_effects(chosen)
    theta = np.concatenate([model.theta, chosen.pack({})])
    free = joint.free()
    free[joint.layout.size + 3 :] = False
    whole, some = joint.normal(theta), joint.normal(theta, free)
    move = np.ix_(free, free)
    assert some.matrix[move] == pytest.approx(whole.matrix[move], rel=1e-12)
    assert some.right[free] == pytest.approx(whole.right[free], rel=1e-12)
    assert np.any(whole.matrix[~free])
    assert not np.any(some.matrix[~free])

    def unasked(*_):
        raise AssertionError("slopes were asked for again")

    monkeypatch.setattr(joint._forces, "linear", unasked)
    assert joint.normal(theta.copy(), free.copy()) is some
    joint.weights = 2.0 * joint.weights
    with pytest.raises(AssertionError, match="asked for again"):
        joint.normal(theta, free)
