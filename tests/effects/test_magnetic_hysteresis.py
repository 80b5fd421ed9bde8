"""The field's memory of the current: its loops' form, and the way back through them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mrctl.model.effects.registry import effects
from mrctl.simulate import stages

DT_S = 0.0005
EFFECT = effects()["magnetic_hysteresis"]
FORMS = {"play": (0.08, 1.0, 0.0), "part play": (0.08, 0.5, 0.0), "smooth": (0.08, 0.6, 1.0)}
FORMS["both"] = (0.12, 0.8, 0.4)
each_form = pytest.mark.parametrize("p", FORMS.values(), ids=FORMS)

a_form = st.tuples(st.floats(0.0, 0.5), st.floats(0.1, 1.0), st.floats(0.0, 1.0))
currents = st.lists(st.floats(0.0, 3.0), min_size=1, max_size=30)


def field(p, current):
    return stages.field_current([(EFFECT, p)], current, DT_S)


def wandering(seed=7, turns=40):
    """Linear ways between random currents, the first from 0 A."""
    corners = np.r_[0.0, np.random.default_rng(seed).uniform(0.0, 2.0, turns)]
    return np.concatenate([np.linspace(a, b, 200, endpoint=False) for a, b in pairwise(corners)])


def coleman_hodgdon(current, w, alpha):
    """i - e, de/di = w - alpha sign(di) e, by Runge-Kutta in 20 steps a sample."""
    e, out = 0.0, [current[0]]
    for before, now in pairwise(current):
        h, side = (now - before) / 20, np.sign(now - before)
        for _ in range(20):
            k1 = w - alpha * side * e
            k2 = w - alpha * side * (e + 0.5 * h * k1)
            k3 = w - alpha * side * (e + 0.5 * h * k2)
            k4 = w - alpha * side * (e + h * k3)
            e += h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
        out.append(now - e)
    return np.array(out)


def play(current, half_width):
    y, out = 0.0, []
    for now in current:
        y = min(max(y, now - half_width), now + half_width)
        out.append(y)
    return np.array(out)


@pytest.mark.parametrize(("half_width", "share"), [(0.08, 0.6), (0.15, 1.0), (0.5, 0.1), (0.01, 1.0)])
def test_the_smooth_loop_solves_the_equation_of_coleman_and_hodgdon(half_width, share):
    current = wandering()
    exact = coleman_hodgdon(current, 0.5 * share, 0.5 * share / half_width)
    assert field((half_width, share, 1.0), current) == pytest.approx(exact, abs=1e-9)


def test_without_smoothness_the_field_has_play():
    current = wandering()
    assert field((0.08, 1.0, 0.0), current) == pytest.approx(play(current, 0.08), abs=1e-12)
    part = 0.5 * current + 0.5 * play(current, 0.16)
    assert field((0.08, 0.5, 0.0), current) == pytest.approx(part, abs=1e-12)


def test_between_the_kinds_the_field_is_their_mean():
    current = wandering()
    sharp, smooth = (field((0.1, 0.7, kind), current) for kind in (0.0, 1.0))
    assert field((0.1, 0.7, 0.3), current) == pytest.approx(0.7 * sharp + 0.3 * smooth, abs=1e-12)


@each_form
def test_share_is_the_slope_of_the_deviation_as_the_loop_turns_round(p):
    current = np.array([0.0, 3.0, 3.0 - 1e-6])
    deviation = current - field(p, current)
    assert deviation[1] == pytest.approx(p[0], rel=1e-3)
    assert (deviation[2] - deviation[1]) / -1e-6 == pytest.approx(p[1], rel=1e-3)


@each_form
def test_a_loop_is_as_wide_as_stated_and_closes(p):
    half_width, share, smoothness = p
    t = np.arange(8000) * DT_S
    current = 1.5 - 1.5 * np.cos(2.0 * np.pi * t)
    out = field(p, current)
    rising, falling = (
        np.interp(1.5, current[2000:3001], out[2000:3001]),
        np.interp(1.5, current[3000:4001][::-1], out[3000:4001][::-1]),
    )
    unfinished = smoothness / np.cosh(0.5 * share * 1.5 / half_width)  # of Coleman and Hodgdon's, 1.5 A on
    assert unfinished < 0.01
    assert falling - rising == pytest.approx(2.0 * half_width * (1.0 - unfinished), abs=1e-6)
    assert out[2000:4000] == pytest.approx(out[4000:6000], abs=1e-5)
    assert np.all(out >= 0.0)


@each_form
def test_a_closed_cycle_of_any_form_comes_to_a_loop_that_repeats(p):
    corners = np.random.default_rng(3).uniform(0.2, 1.4, 12)
    cycle = np.concatenate(
        [np.linspace(a, b, 50, endpoint=False) for a, b in zip(corners, np.roll(corners, -1), strict=True)]
    )
    out = field(p, np.tile(cycle, 8)).reshape(8, -1)
    assert out[-1] == pytest.approx(out[-2], abs=1e-9)
    assert np.ptp(cycle - out[-1]) > p[0]  # and it is not closed for being flat


@settings(max_examples=200, deadline=None)
@given(a_form, currents)
def test_the_field_is_never_negative_and_never_further_off_than_half_the_width(p, way):
    current = np.array(way)
    out = field(p, current)
    assert np.min(out) >= -1e-12
    assert np.max(np.abs(current - out)) <= p[0] + 1e-12


@settings(max_examples=200, deadline=None)
@given(a_form, st.floats(0.0, 3.0), currents)
def test_the_field_does_not_depend_on_how_often_the_current_is_sampled(p, first, way):
    corners = np.array([first, *way])
    fine = np.concatenate([np.linspace(a, b, 8) for a, b in pairwise(corners)])
    assert field(p, fine)[7::8] == pytest.approx(field(p, corners)[1:], abs=1e-9)


@settings(max_examples=500, deadline=None)
@given(a_form, st.floats(0.0, 3.0), currents)
@example((0.08, 1.0, 0.0), 1.0, [1.0, 1.0 + 1e-8, 1.0, 0.5, 2.0])
@example((0.08, 1.0, 1.0), 3.0, [3.0, 3.0 - 1e-8, 3.0, 0.5, 2.0])
@example((0.5, 1.0, 1e-12), 3.0, [2.0, 2.5, 2.0, 0.5, 2.0])
@example((1e-9, 0.1, 0.5), 3.0, [2.0, 2.5, 2.0, 0.5, 2.0])
@example((5e-324, 1.0, 1.0), 3.0, [2.0, 2.0, 0.5])
def test_undoing_it_gives_the_wanted_field_time_after_time(p, first, wishes):
    state = EFFECT.initial(p, first, DT_S)
    for wanted in wishes:
        command = EFFECT.undo(p, state, wanted, DT_S)
        assert EFFECT.step(p, state, command, DT_S) == pytest.approx(wanted, abs=2e-9)


@each_form
def test_undoing_it_gives_the_current_back_where_only_one_makes_the_field(p):
    current = wandering(seed=11)
    state, again = EFFECT.initial(p, current[0], DT_S), []
    for wanted in field(p, current):
        again.append(EFFECT.undo(p, state, wanted, DT_S))
        EFFECT.step(p, state, again[-1], DT_S)
    off = np.abs(np.array(again) - current)
    assert np.max(off) <= (2.0 * p[0] + 1e-9 if p[1] == 1.0 and p[2] == 0.0 else 1e-6)


@each_form
def test_a_wish_that_stands_still_but_for_rounding_leaves_the_command_where_it_is(p):
    state = EFFECT.initial(p, 0.7, DT_S)
    commands = []
    for k in range(100):
        commands.append(EFFECT.undo(p, state, 1.3 + 1e-13 * (-1) ** k, DT_S))
        EFFECT.step(p, state, commands[-1], DT_S)
    assert np.ptp(commands) == 0.0
