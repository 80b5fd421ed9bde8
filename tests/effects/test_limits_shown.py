"""What a step keeps its numbers within stands in the equation that `mrctl effects` shows."""

from __future__ import annotations

import math

import pytest
from effects.equations import TABLES

from mrctl.model.effects import (
    cavitation,
    end_stop,
    gas_spring,
    off_state_backbone,
    preyield_stiffness,
    rebound_asymmetry,
    stroke_dependent_damping,
)

DT_S = 1e-3


@pytest.mark.parametrize(
    ("effect", "p", "at"),
    [
        (stroke_dependent_damping, (-200.0, 0.0, 0.0, 0.0, 1.0, 1.0), (0.1, 0.02, 0.0, 25.0)),
        (rebound_asymmetry, (-0.9, -50.0, 0.0, 0.0, 1.0, 0.0), (-0.1, 0.0, 1.0, 25.0)),
        (off_state_backbone, (-0.99, 0.0, 0.05, 0.4, 1.0, -0.9), (-1e-3, 0.0, 0.0, 25.0)),
    ],
)
def test_a_factor_has_a_floor(effect, p, at):
    assert effect.EFFECT.within(p) == p  # the bounds reach it
    assert effect.step(p, [], *at, DT_S) == effect.SMALLEST_FACTOR
    assert f", at least {effect.SMALLEST_FACTOR:g}; " in effect.EFFECT.equation


def test_the_gas_is_compressed_to_a_share_of_its_volume_at_most():
    p = (0.0, 1000.0, 60.0, 0.0)
    assert gas_spring.EFFECT.within(p) == p
    force_n = gas_spring.step(p, [], 0.0, 0.02, 0.0, 0.0, 25.0, DT_S)
    assert force_n == pytest.approx(1000.0 * 0.02 / gas_spring.SMALLEST_VOLUME)
    assert (
        f"volume = 1 - progression x, at least {gas_spring.SMALLEST_VOLUME:g}" in gas_spring.EFFECT.equation
    )


@pytest.mark.parametrize(
    ("velocity_m_s", "force_n"),
    [(1.0, 100.0 + 500.0 * (1.0 - math.exp(-end_stop.UNIT_M / end_stop.CONTACT_M))), (-1.0, 0.0)],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_stop_s_damping_comes_in_with_depth_and_never_pulls(velocity_m_s, force_n, side):
    p = (0.02, 100.0, 1.5, 500.0, 0.0, 0.0, 0.2)
    at = side * velocity_m_s, side * (0.02 + end_stop.UNIT_M)
    wanted_n = side * force_n * (1.2 if side < 0.0 else 1.0)
    assert end_stop.step(p, [0.0], *at, 0.0, 0.0, 25.0, DT_S) == pytest.approx(wanted_n)
    assert "F = sign(y) max(force_at_1mm (d / 1 mm)^exponent" in end_stop.EFFECT.equation
    assert f"v (1 - exp(-d / {1e3 * end_stop.CONTACT_M:g} mm)), 0)" in end_stop.EFFECT.equation


@pytest.mark.parametrize(
    ("p", "same"),
    [
        ((1000.0, 50.0, 0.0, 2e-3, 50.0), (100.0, 5.0, 0.0, 2e-3, 0.0)),
        ((100.0, 90.0, 0.0, 2e-3, 0.0), (100.0, 50.0, 0.0, 2e-3, 0.0)),
    ],
)
def test_what_cavitates_keeps_a_share_of_its_limit_and_a_knee_of_some_sharpness(p, same):
    p, same = ((*one, *cavitation.EFFECT.neutral[len(one) :]) for one in (p, same))
    assert cavitation.EFFECT.within(p) == p
    first, second = (
        cavitation.step(
            q, [0.0] * len(cavitation.EFFECT.states), -500.0, -0.1, 0.1, 25.0, -500.0, 600.0, TABLES, DT_S
        )
        for q in (p, same)
    )
    assert first == pytest.approx(second)
    assert f", at least {cavitation.LEAST_SHARE:g} limit; " in cavitation.EFFECT.equation
    assert f"knee/limit at most {cavitation.SOFTEST:g} there" in cavitation.EFFECT.equation


def test_what_is_elastic_creeps_near_rest_as_it_did_before():
    smallest, p = preyield_stiffness.SMALLEST_SHAPE, preyield_stiffness.EFFECT.typical
    slow, rest = 0.05 * smallest, 0.0
    for creep, at_rest in ((0.0, 0.0), (1.0, 0.05)):
        q = (*p[:2], creep, *p[3:])
        state = preyield_stiffness.start(q, 600.0 * smallest, slow, 0.0, 600.0, DT_S)
        preyield_stiffness.step(q, state, 0.0, rest, 0.0, 600.0, DT_S)
        assert state[6] == pytest.approx(at_rest)
    assert f"|v|/|r| as it was where |r| < {smallest:g}, " in preyield_stiffness.EFFECT.equation
