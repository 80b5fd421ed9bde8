"""Cavitation: what limits the compression force, and the cavity that opens beyond."""

from __future__ import annotations

import math

import numpy as np
import pytest
from effects.conftest import make_damper, make_drive, with_effects
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.model.effects.registry import effects
from mrctl.simulate import trace


@settings(max_examples=300, deadline=None)
@given(st.floats(-1e5, 1e5), st.floats(50.0, 5e4), st.floats(1.0, 5e3))
def test_cavitation_limits_compression_only_and_keeps_the_order_of_forces(force, limit, knee):
    step = effects()["cavitation"].step
    plain = (limit, knee, 0.0, 2e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    limited = step(plain, [0.0, 0.0, 0.0], force, 0.0, 0.0, 25.0, 0.001)
    assert limited >= -limit * (1.0 + 1e-9)
    assert limited >= force - 1e-9
    if force >= 0.0:
        assert limited == force
    assert step(plain, [0.0, 0.0, 0.0], force + 1.0, 0.0, 0.0, 25.0, 0.001) >= limited - 1e-12 * abs(limited)
    lacks = min(knee, 0.5 * limit)
    assert step(plain, [0.0, 0.0, 0.0], -limit, 0.0, 0.0, 25.0, 0.001) == pytest.approx(lacks - limit)


def test_a_cavity_opens_by_what_the_fluid_does_not_follow_and_costs_rebound_force_until_it_is_closed():
    step, state = effects()["cavitation"].step, [0.0, 0.0, 0.0]
    p = (500.0, 10.0, 0.8, 2e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(100):
        assert step(p, state, -1000.0, -0.2, 0.0, 25.0, 0.001) == pytest.approx(-500.0)
    assert state[0] == pytest.approx(0.1 * 0.2 * 0.5)
    partly = [0.0, 0.0, 0.0]
    for _ in range(100):
        step((*p[:5], 0.75, 0.0, 0.0, 0.0, 0.0), partly, -1000.0, -0.2, 0.0, 25.0, 0.001)
    assert partly[0] == pytest.approx(0.25 * state[0])
    back = [step(p, state, 800.0, 0.2, 0.0, 25.0, 0.001) for _ in range(100)]
    assert back[0] == pytest.approx(800.0 * (1.0 - 0.8 * 0.01 / 0.012))
    assert np.all(np.diff(back) >= 0.0)
    assert back[-1] == 800.0


def test_the_gas_holds_up_more_when_it_is_warm_and_the_further_the_rod_is_in():
    step, p = effects()["cavitation"].step, (500.0, 10.0, 0.0, 2e-3, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    limits = [step(p, [0.0, 0.0, 0.0], -2000.0, -0.2, x, 25.0, 0.001) for x in (-0.05, 0.0, 0.05, 1.0)]
    assert limits == pytest.approx([-700.0, -500.0, -300.0, -50.0], rel=1e-6)
    warm = [
        step((*p[:6], 3.4e-3, *p[7:]), [0.0, 0.0, 0.0], -2000.0, -0.2, 0.0, c, 0.001) for c in (25.0, 75.0)
    ]
    assert warm == pytest.approx([-500.0, -585.0], rel=1e-6)


def test_only_the_fluids_force_is_limited():
    """Friction, gas, a stop, a mass and an offset pull at the rod whatever the fluid does."""
    run = make_drive()
    limit = {"limit_n": 300.0, "knee_n": 1.0, "loss": 0.0, "closing_m": 2e-3}
    alone = trace(run, with_effects(make_damper(), cavitation=limit))
    at_limit = pytest.approx(-300.0, abs=1.0)
    assert alone.force_n.min() == at_limit
    for name in ("coulomb_friction", "force_offset", "gas_spring", "end_stop", "fluid_inertia"):
        own = {p.name: p.typical for p in effects()[name].parameters}
        both, without = (
            trace(run, with_effects(make_damper(), **chosen, **{name: own}))
            for chosen in ({"cavitation": limit}, {})
        )
        assert both.force_n - alone.force_n == pytest.approx(without.rod_n[name], abs=1e-9)
    own = {p.name: p.typical for p in effects()["viscous_damping"].parameters}
    both = trace(run, with_effects(make_damper(), cavitation=limit, viscous_damping=own))
    assert both.force_n.min() == at_limit


def test_an_open_cavity_holds_the_force_at_the_limit_until_fluid_has_filled_it():
    """Held against the cavity's volume by hand: it grows by what is swept less what flows at the limit."""
    step, state = effects()["cavitation"].step, [0.0, 0.0, 0.0]
    p, dt = (500.0, 0.5, 0.0, 1e-5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0), 1e-4
    t = np.arange(20000) * dt
    v = 0.4 * np.sin(2.0 * np.pi * 1.0 * t)
    alone = 800.0 * np.tanh(v / 0.2)
    follows = 0.2 * math.atanh(500.0 / 800.0)
    out = np.array([step(p, state, f, u, 0.0, 25.0, dt) for f, u in zip(alone, v, strict=True)])
    volume, open_ = 0.0, np.zeros(t.size, dtype=bool)
    for k, speed in enumerate(v):
        volume = max(0.0, volume - (speed + follows) * dt) if volume > 0.0 or speed < -follows else 0.0
        open_[k] = volume > 0.0
    assert v[open_].max() > 0.05  # well into the way back
    held = np.abs(out + 500.0) < 5.0
    assert np.count_nonzero(held != open_) < 0.01 * np.count_nonzero(open_)
    free = ~open_ & ~held & (alone > -300.0)
    assert np.count_nonzero(np.abs(out - alone)[free] > 1.0) <= 1  # the sample in which it closes


def test_a_speed_that_is_followed_at_a_larger_current_is_not_one_at_a_smaller():
    """While fluid follows nothing opens, at whatever current: the speed is learnt where it no longer does."""
    step, state = effects()["cavitation"].step, [0.0, 0.0, 0.0]
    p = (500.0, 0.5, 0.0, 1e-5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    for force, speed in ((-100.0, 0.3), (-300.0, 0.2), (-499.0, 0.1)):
        step(p, state, force, -speed, 0.0, 25.0, 0.001)
        assert state[0] == 0.0
    step(p, state, -600.0, -0.15, 0.0, 25.0, 0.001)
    assert state[:2] == [0.0, pytest.approx(0.15)]
    step(p, state, -700.0, -0.2, 0.0, 25.0, 0.001)
    assert state[0] == pytest.approx(0.05 * 0.001)


def test_a_cavity_begins_to_close_when_the_motion_turns_whatever_sign_the_force_has():
    """Behind a lag the force turns later; until then it falls as it does after."""
    step, p = effects()["cavitation"].step, (500.0, 10.0, 0.8, 2e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    made, left = {}, {}
    for force_n in (-100.0, 100.0):
        s = [2e-3, 0.0, 0.0]
        made[force_n] = step(p, s, force_n, 0.3, 0.0, 25.0, 1e-3)
        left[force_n] = s[0]
    assert made[100.0] == pytest.approx(60.0)
    assert made[-100.0] == pytest.approx(-60.0, rel=1e-3)
    assert left[-100.0] == pytest.approx(left[100.0], rel=1e-3)
    assert left[100.0] == pytest.approx(2e-3 - 3e-4)


@pytest.mark.parametrize("held", [0.0, 1.0])
def test_a_leak_closes_a_cavity_besides_what_the_piston_sweeps_but_opens_none(held):
    step, leak = effects()["cavitation"].step, 0.15
    tight, leaky = ((500.0, 0.5, 0.8, 1e-4, 0.0, 0.0, 0.0, held, flow, 0.0) for flow in (0.0, leak))
    closed = []
    for p in (tight, leaky):
        state = [0.0, 0.0, 0.0]
        step(p, state, -490.0, -0.2, 0.0, 25.0, 1e-3)
        for _ in range(50):
            step(p, state, -900.0, -0.5, 0.0, 25.0, 1e-3)
        opened = state[0]
        step(p, state, 400.0, 0.1, 0.0, 25.0, 1e-3)
        closed.append((opened, opened - state[0]))
    assert closed[0][0] == closed[1][0] > 0.0
    assert closed[1][1] - closed[0][1] == pytest.approx(leak * 1e-3)


def test_what_is_taken_off_comes_late_by_its_lag_and_stands_at_the_start():
    effect, dt, lag = effects()["cavitation"], 1e-4, 2e-3
    at_once = (500.0, 10.0, 0.0, 2e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    late = (*at_once[:9], lag)
    state = effect.start(late, -100.0, -0.1, 0.0, 25.0, dt)
    assert effect.step(late, state, -100.0, -0.1, 0.0, 25.0, dt) == pytest.approx(
        effect.step(at_once, [0.0, 0.0, 0.0], -100.0, -0.1, 0.0, 25.0, dt)
    )
    t = np.arange(1, 200) * dt
    made = np.array([effect.step(late, state, -1000.0, -0.1, 0.0, 25.0, dt) for _ in t])
    assert made == pytest.approx(-1000.0 + 500.0 * (1.0 - np.exp(-t / lag)), abs=15.0)
