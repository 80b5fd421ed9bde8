"""Every effect, ours and a stranger's, keeps the same promises."""

from __future__ import annotations

import json
import random
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_damper, make_drive, with_effects
from contract import by_sample, extended, force, other_than_typical, recovered, tracking_rmse

from mrctl.model.effects.base import Stage, Undo
from mrctl.model.effects.card import card
from mrctl.model.effects.faults import faults
from mrctl.model.effects.registry import effects
from mrctl.simulate import trace

NAMES = (
    "gas_spring",
    "fluid_inertia",
    "coulomb_friction",
    "viscous_damping",
    "quadratic_damping",
    "force_offset",
    "current_lag",
    "magnetic_hysteresis",
    "self_heating",
    "end_stop",
    "cavitation",
    "stroke_dependent_damping",
    "off_state_backbone",
    "rebound_asymmetry",
    "preyield_stiffness",
    "mount_compliance",
    "sensor_delay",
)

# RMS change of the force in N that an effect of the usual size makes on a damper of 2 kN, rich drive.
USUAL_SIZE_N = {
    "gas_spring": (50, 300),
    "fluid_inertia": (10, 200),
    "coulomb_friction": (20, 100),
    "viscous_damping": (30, 300),
    "quadratic_damping": (10, 200),
    "force_offset": (10, 90),
    "current_lag": (20, 300),
    "magnetic_hysteresis": (15, 150),
    "self_heating": (10, 300),
    "end_stop": (100, 3000),
    "cavitation": (20, 500),
    "stroke_dependent_damping": (20, 300),
    "off_state_backbone": (5, 100),
    "rebound_asymmetry": (30, 300),
    "preyield_stiffness": (100, 700),
    "mount_compliance": (50, 700),
    "sensor_delay": (20, 300),
}


def drive_for(effect):
    """Heat takes a minute, the rest seconds."""
    return make_drive(60.0, 0.002) if effect.stage is Stage.TEMPERATURE else make_drive()


@pytest.fixture(params=NAMES)
def effect(request):
    return effects()[request.param]


def test_all_effects_of_the_field_are_there():
    assert set(NAMES) <= set(effects())


def test_an_effect_is_described_whole(effect):
    assert faults(effect) == []
    assert effect.summary.endswith(".")
    assert effect.inverse_note.endswith(".")


def test_the_neutral_values_leave_the_old_model_to_the_last_bit(effect):
    drive = drive_for(effect)
    assert np.array_equal(force(extended(effect, effect.neutral), drive), force(make_damper(), drive))


def test_the_force_stays_finite_at_the_corners_of_the_bounds(effect):
    """At all of them; of more parameters than twelve at as many as those have, drawn."""
    drive = make_drive(1.0, 0.001)
    base = trace(drive, make_damper())
    corners = range(2 ** len(effect.parameters))
    for pick in random.Random(1).sample(corners, min(len(corners), 2**12)):
        corner = tuple(
            (p.low, p.high)[pick >> k & 1] if p.high > p.low else p.low
            for k, p in enumerate(effect.parameters)
        )
        assert np.all(np.isfinite(trace(drive, extended(effect, corner), like=base).force_n)), corner


@pytest.mark.parametrize("high", [False, True])
def test_a_current_that_its_sensors_noise_takes_below_zero_breaks_nothing(effect, high):
    p = tuple(
        q.high if high else other
        for q, other in zip(effect.parameters, other_than_typical(effect), strict=True)
    )
    drive = make_drive(1.0, 0.001)
    off = replace(drive, current_a=np.zeros(drive.size))
    for noise_a in (1e-2, 3e-3):
        noisy = replace(drive, current_a=np.where(np.arange(drive.size) % 2, -noise_a, noise_a))
        forces = force(extended(effect, p), noisy)
        assert np.all(np.isfinite(forces))
        assert np.max(np.abs(forces)) < 2.0 * np.max(np.abs(force(extended(effect, p), off)))


@pytest.mark.parametrize("dt_s", [0.0005, 0.002, 0.005])
def test_the_vehicle_and_the_desk_compute_the_same_force(effect, dt_s):
    drive = make_drive(1.0, dt_s)
    damper = extended(effect, other_than_typical(effect), 1.0 / dt_s)
    desk = force(damper, drive)
    assert np.max(np.abs(by_sample(damper, drive) - desk)) <= 1e-9 * np.max(np.abs(desk))


def test_the_usual_size_is_what_dampers_show(effect):
    drive = drive_for(effect)
    change = force(extended(effect, effect.typical), drive) - force(make_damper(), drive)
    low, high = USUAL_SIZE_N[effect.name]
    assert low <= np.sqrt(np.mean(change**2)) <= high


def test_least_squares_finds_the_parameters_again(effect):
    truth = other_than_typical(effect)
    found = recovered(effect, truth, drive_for(effect))
    for parameter, was, is_now in zip(effect.parameters, truth, found, strict=True):
        assert is_now == pytest.approx(was, rel=1e-3, abs=1e-3 * parameter.step_scale), parameter.name


def test_the_inverse_undoes_what_it_says_it_undoes(effect):
    drive = drive_for(effect)
    t = np.arange(drive.size) * drive.dt_s
    top = 0.25 if effect.name == "off_state_backbone" else 2.0
    current = 0.1 + (top - 0.1) * 0.5 * (1.0 + np.sin(2.0 * np.pi * 0.7 * t))
    truth = extended(effect, effect.typical)
    plain = tracking_rmse(make_damper(), truth, drive, current)
    ours = tracking_rmse(truth, truth, drive, current)
    without_effect = tracking_rmse(make_damper(), make_damper(), drive, current)
    if effect.inverse is Undo.NOT_UNDONE:
        assert ours <= 1.01 * plain
    else:
        assert ours <= without_effect + 0.3 * (plain - without_effect)


def test_a_card_is_complete_json(effect):
    again = json.loads(json.dumps(card(effect), allow_nan=False))
    assert again == card(effect)
    assert [p["name"] for p in again["parameters"]] == [p.name for p in effect.parameters]
    assert all(
        again[key] for key in ("name", "stage", "summary", "equation", "source", "inverse", "inverse_note")
    )


def test_two_effects_act_together_in_the_fixed_order_whatever_the_order_they_are_listed_in():
    drive = make_drive(1.0)
    one, other = effects()["current_lag"], effects()["magnetic_hysteresis"]
    a, b = {one.name: one.mapping(one.typical)}, {other.name: other.mapping(other.typical)}
    assert np.array_equal(
        force(with_effects(make_damper(), **a, **b), drive),
        force(with_effects(make_damper(), **b, **a), drive),
    )
