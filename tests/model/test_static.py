"""The static model and its exact inverse."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model.dampers import tables

from mrctl.model.static import backbone_force, transition_increases
from mrctl.model.static_inverse import Reach, invert_backbone
from mrctl.model.tables import interpolate

BLENDED = tables()
SWITCHED_UP = tables(off_below=0.5, on_above=0.5)  # hot: h_on > h_off, a gap of forces at 0.5 A
SWITCHED_DOWN = tables(h_off=(1.0, 1.2, 1.3, 1.4), off_below=0.5, on_above=0.5)  # two currents for one force
LIMIT_A = 3.0

velocities = st.floats(-2.0, 2.0, allow_nan=False) | st.floats(-1e-6, 1e-6) | st.just(0.0)
temperatures = st.floats(-60.0, 200.0, allow_nan=False)
forces = st.floats(-5000.0, 5000.0, allow_nan=False) | st.floats(-1e-9, 1e-9)


def reachable(force, v, T, t):
    weakest, strongest = sorted(
        (backbone_force(v, 0.0, T, t), backbone_force(v, LIMIT_A, T, t)),
        key=abs,
    )
    low, high = sorted((weakest, strongest))
    return min(max(force, low), high)


@settings(max_examples=2000, deadline=None)
@given(force=forces, v=velocities, T=temperatures, was_on=st.booleans())
def test_forward_of_inverse_is_the_reachable_part_of_the_wish(force, v, T, was_on):
    found = invert_backbone(force, v, T, BLENDED, LIMIT_A, was_on=was_on)
    assert 0.0 <= found.current_a <= LIMIT_A
    assert abs(backbone_force(v, found.current_a, T, BLENDED) - reachable(force, v, T, BLENDED)) < 1e-6


@settings(max_examples=500, deadline=None)
@given(
    current=st.floats(0.0, LIMIT_A), v=st.floats(0.001, 0.381), T=temperatures, sign=st.sampled_from([-1, 1])
)
def test_inverse_of_forward_is_the_current(current, v, T, sign):
    force = backbone_force(sign * v, current, T, BLENDED)
    found = invert_backbone(force, sign * v, T, BLENDED, LIMIT_A, was_on=False)
    assert found.current_a == pytest.approx(current, abs=1e-9)


@settings(max_examples=500, deadline=None)
@given(force=forces, v=velocities, T=temperatures, was_on=st.booleans())
def test_switching_h_is_inverted_exactly_outside_its_gap(force, v, T, was_on):
    for t in (SWITCHED_UP, SWITCHED_DOWN):
        found = invert_backbone(force, v, T, t, LIMIT_A, was_on=was_on)
        achieved = backbone_force(v, found.current_a, T, t)
        below = backbone_force(v, math.nextafter(0.5, 0.0), T, t)
        above = backbone_force(v, 0.5, T, t)
        wish = reachable(force, v, T, t)
        in_gap = abs(below) < abs(wish) < abs(above)
        if in_gap:
            assert achieved in (pytest.approx(below, abs=1e-6), pytest.approx(above, abs=1e-6))
        else:
            assert abs(achieved - wish) < 1e-6


def test_a_wish_that_both_states_can_give_keeps_the_state_it_is_in():
    T = 60.0
    force = 0.99 * backbone_force(0.3, math.nextafter(0.5, 0.0), T, SWITCHED_DOWN)
    off = invert_backbone(force, 0.3, T, SWITCHED_DOWN, LIMIT_A, was_on=False)
    on = invert_backbone(force, 0.3, T, SWITCHED_DOWN, LIMIT_A, was_on=True)
    assert not off.on
    assert on.on
    for found in (off, on):
        assert backbone_force(0.3, found.current_a, T, SWITCHED_DOWN) == pytest.approx(force, abs=1e-9)


def test_a_wish_in_the_gap_does_not_chatter():
    T = 75.0
    below = backbone_force(0.3, math.nextafter(0.5, 0.0), T, SWITCHED_UP)
    above = backbone_force(0.3, 0.5, T, SWITCHED_UP)
    on, changes = False, 0
    for k in range(100):
        wish = 0.5 * (below + above) + (1.0 if k % 2 else -1.0)
        found = invert_backbone(wish, 0.3, T, SWITCHED_UP, LIMIT_A, was_on=on)
        changes += found.on != on
        on = found.on
    assert changes == 0


def test_zero_velocity_has_a_defined_answer_for_every_wish():
    for force in (-1e9, -1.0, 0.0, 1.0, 1e9):
        assert invert_backbone(force, 0.0, 50.0, BLENDED, LIMIT_A, was_on=True).current_a == 0.0


def test_reach_says_where_the_wish_lies():
    def reach(force):
        return invert_backbone(force, 0.2, 50.0, BLENDED, LIMIT_A, was_on=False).reach

    weakest = backbone_force(0.2, 0.0, 50.0, BLENDED)
    strongest = backbone_force(0.2, LIMIT_A, 50.0, BLENDED)
    assert reach(-1.0) is Reach.BELOW
    assert reach(0.9 * weakest) is Reach.BELOW
    assert reach(0.5 * (weakest + strongest)) is Reach.WITHIN
    assert reach(1.1 * strongest) is Reach.ABOVE


def test_the_damper_dissipates():
    for v in (-0.5, -0.1, 0.1, 0.5):
        for i in (0.0, 0.7, 3.0):
            assert backbone_force(v, i, 40.0, BLENDED) * v > 0.0


def test_a_transition_that_falls_with_current_is_recognised():
    assert transition_increases(BLENDED)
    assert not transition_increases(tables(h_off=(9.0, 9.0, 9.0, 9.0), off_below=0.5, on_above=0.75))


def test_interpolation_clamps_and_is_exact_at_knots():
    xs, ys = (0.0, 1.0, 4.0), (2.0, -1.0, 5.0)
    assert [interpolate(x, xs, ys) for x in (-9.0, 0.0, 0.5, 1.0, 2.5, 4.0, 9.0)] == [2, 2, 0.5, -1, 2, 5, 5]
