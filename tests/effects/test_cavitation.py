"""Cavitation: what limits the compression force, and the cavity that opens beyond."""

from __future__ import annotations

import math

import numpy as np
import pytest
from effects.conftest import make_damper, make_drive, with_effects
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.model.effects.registry import effects
from mrctl.model.static import compression_speed, static_tables
from mrctl.simulate import trace

EFFECT = effects()["cavitation"]
KNEE_M_S, LEVEL_N = 0.2, 800.0
KNOTS = np.linspace(-1.0, 1.0, 401)
TABLES = static_tables(
    (0.0, 1.0), (LEVEL_N, 2.0 * LEVEL_N), KNOTS.tolist(), np.tanh(KNOTS / KNEE_M_S).tolist(), (0.0, 100.0),
    (1.0, 1.0), (1.0, 1.0), 0.0, 0.0,
)  # fmt: skip


def _p(*first: float, **others: float) -> tuple[float, ...]:
    """The first parameters, others by name, the rest neutral."""
    named = dict(zip((q.name for q in EFFECT.parameters), EFFECT.neutral, strict=True))
    named |= dict(zip(named, first, strict=False)) | others
    return tuple(named.values())


def _begun() -> list[float]:
    return [0.0] * len(EFFECT.states)


def _opening(p, force_n, v) -> list[float]:
    """The state of a damper in which a cavity opens now."""
    return EFFECT.start(p, force_n, v, 0.0, 25.0, force_n, LEVEL_N, TABLES, 1e-3)


def _step(p, s, force_n, v, x=0.0, warm_c=25.0, dt_s=1e-3, level_n=LEVEL_N) -> float:
    """The step, H passing on what goes into it."""
    return EFFECT.step(p, s, force_n, v, x, warm_c, force_n, level_n, TABLES, dt_s)


@settings(max_examples=300, deadline=None)
@given(st.floats(-1e5, 1e5), st.floats(50.0, 5e4), st.floats(1.0, 5e3))
def test_cavitation_limits_compression_only_and_keeps_the_order_of_forces(force, limit, knee):
    plain = _p(limit, knee)
    limited = _step(plain, _begun(), force, 0.0)
    assert limited >= -limit * (1.0 + 1e-9)
    assert limited >= force - 1e-9
    if force >= 0.0:
        assert limited == force
    assert _step(plain, _begun(), force + 1.0, 0.0) >= limited - 1e-12 * abs(limited)
    lacks = min(knee, 0.5 * limit)
    assert _step(plain, _begun(), -limit, 0.0) == pytest.approx(lacks - limit)


def test_a_cavity_opens_by_what_the_fluid_does_not_follow_and_costs_rebound_force_until_it_is_closed():
    p = _p(500.0, 10.0, 0.8)
    state = _opening(p, -1000.0, -0.2)
    for _ in range(100):
        assert _step(p, state, -1000.0, -0.2) == pytest.approx(-500.0)
    assert state[0] == pytest.approx(0.1 * 0.2 * 0.5)
    refilled = _p(500.0, 10.0, 0.8, refilled=0.75)
    partly = _opening(refilled, -1000.0, -0.2)
    for _ in range(100):
        _step(refilled, partly, -1000.0, -0.2)
    assert partly[0] == pytest.approx(0.25 * state[0])
    back = [_step(p, state, 800.0, 0.2) for _ in range(100)]
    left = 0.01 + 0.5 * (0.1 - 0.2) * 1e-3  # the speed runs straight over the sample
    on_the_way = np.linspace(0.01, left, 101)
    assert back[0] == pytest.approx(800.0 * (1.0 - 0.8 * np.mean(on_the_way / (on_the_way + 2e-3))), rel=1e-5)
    assert np.all(np.diff(back) >= 0.0)
    assert back[-1] == 800.0


def test_a_cavity_opens_by_the_flow_that_lacks_where_it_is_asked_to():
    """Of a force that hardly grows with speed a small share is missing, but much of the flow."""
    p, force_n, v = _p(500.0, 10.0, 0.8, by_flow=1.0), -LEVEL_N * math.tanh(2.0), -2.0 * KNEE_M_S
    state = _opening(p, force_n, v)
    for _ in range(100):
        bent_n = -_step(p, state, force_n, v)
    follows = KNEE_M_S * math.atanh(500.0 / LEVEL_N)
    assert state[0] == pytest.approx(0.1 * (-v - follows), rel=1e-3)
    half = _p(500.0, 10.0, 0.8, by_flow=0.5)
    partly = _opening(half, force_n, v)
    for _ in range(100):
        _step(half, partly, force_n, v)
    by_share = 0.1 * -v * (1.0 - bent_n / -force_n)
    assert partly[0] == pytest.approx(0.5 * (state[0] + by_share), rel=1e-3)


def test_what_opened_by_flow_is_filled_by_it_as_the_piston_slows_down():
    p, slow = _p(500.0, 10.0, 0.8, by_flow=1.0), -0.5 * KNEE_M_S
    follows, force_n = KNEE_M_S * math.atanh(500.0 / LEVEL_N), -LEVEL_N * math.tanh(0.5)
    state = [0.01, 0.0, 0.0, 0.0, -slow - follows, 0.0, 0.0]
    for _ in range(100):
        _step(p, state, force_n, slow)
    assert state[0] == pytest.approx(0.01 - 0.1 * (follows + slow), rel=1e-3)


@pytest.mark.parametrize(("held", "cavity"), [(0.0, 0), (1.0, 1)])
def test_other_flow_that_goes_with_a_cavity_leaves_it_at_a_size_and_ends_it_at_its_rate(held, cavity):
    """As it opens at a speed, it comes to that speed over the rate; a piston at rest lets it go."""
    p = _p(500.0, 0.5, 0.8, held=held, by_flow=1.0, filling_per_s=50.0)
    force_n, v = -LEVEL_N * math.tanh(2.0), -2.0 * KNEE_M_S
    state, dt_s = _opening(p, force_n, v), 1e-4
    for _ in range(5000):
        _step(p, state, force_n, v, dt_s=dt_s)
    opens = -v - KNEE_M_S * math.atanh(500.0 / LEVEL_N)
    assert state[cavity] == pytest.approx(opens / 50.0, rel=0.01)
    if held == 0.0:
        whole = state[0]
        for _ in range(200):
            _step(p, state, 0.0, 0.0, dt_s=dt_s)
        assert state[0] == pytest.approx(whole * math.exp(-1.0), rel=0.01)


@settings(max_examples=100, deadline=None)
@given(st.floats(0.0, 0.99))
def test_a_cavity_that_closes_within_a_sample_gives_the_force_back_by_the_part_that_is_left(left):
    """So a fit sees where it closes; at samples alone it would not, but in jumps."""
    p, dt_s = _p(500.0, 10.0, 1.0, 1e-5), 1e-3
    state = [left * 0.2 * dt_s, 0.0, 0.0, 0.0, -0.2, 0.0, 0.0]
    force = _step(p, state, 800.0, 0.2)
    assert state[0] == 0.0
    cavity = np.maximum(left * 0.2 * dt_s - 0.2 * dt_s * np.linspace(0.0, 1.0, 20001), 0.0)
    assert force == pytest.approx(800.0 * (1.0 - np.mean(cavity / (cavity + 1e-5))), abs=0.1)


def test_the_gas_holds_up_more_when_it_is_warm_and_the_further_the_rod_is_in():
    p = _p(500.0, 10.0, rise_per_m=8.0)
    limits = [_step(p, _begun(), -2000.0, -0.2, x) for x in (-0.05, 0.0, 0.05, 1.0)]
    assert limits == pytest.approx([-700.0, -500.0, -300.0, -50.0], rel=1e-6)
    p = _p(500.0, 10.0, warming_per_k=3.4e-3)
    warm = [_step(p, _begun(), -2000.0, -0.2, 0.0, c) for c in (25.0, 75.0)]
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


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_the_speed_of_a_force_in_compression_is_gs(share):
    assert compression_speed(share, TABLES) == pytest.approx(KNEE_M_S * math.atanh(share), rel=1e-3)


def test_no_speed_in_the_table_has_more_than_all_of_it():
    end = math.tanh(1.0 / KNEE_M_S)
    assert compression_speed(2.0 * end, TABLES) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("firming", "refilled", "slack"),
    [(0.0, 0.0, 0.0), (12.0, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.5)],
)
def test_an_open_cavity_holds_the_force_at_the_limit_until_fluid_has_filled_it(firming, refilled, slack):
    """Held against the cavity's volume by hand: it grows by what is swept less what flows at the limit."""
    state, dt = _begun(), 1e-4
    p = _p(500.0, 0.5, 0.0, 3e-6, refilled=refilled, held=1.0, firming_per_m=firming, slack=slack)
    t = np.arange(20000) * dt
    v = 0.4 * np.sin(2.0 * np.pi * 1.0 * t)
    alone = LEVEL_N * np.tanh(v / KNEE_M_S)
    out = np.array([_step(p, state, f, u, dt_s=dt) for f, u in zip(alone, v, strict=True)])
    volume, want = 0.0, np.empty(t.size)
    for k, speed in enumerate(v):
        limit = 500.0 * (1.0 + firming * volume) * (1.0 - slack if speed > 0.0 else 1.0)
        follows = KNEE_M_S * math.atanh(min(limit / LEVEL_N, 0.999))
        opens = -(speed + follows)
        volume = max(0.0, volume + opens * (1.0 - refilled if opens > 0.0 else 1.0) * dt)
        want[k] = -limit if volume > 0.0 else alone[k]
    open_ = want != alone
    assert v[open_].max() > 0.05  # well into the way back
    assert np.count_nonzero(np.abs(out - want) > 10.0) < 0.01 * np.count_nonzero(open_)


def test_fluid_that_yields_at_more_follows_the_slower_at_the_limit():
    p = _p(500.0, 0.5, 0.0, 1e-5, held=1.0)
    for level_n in (700.0, 1600.0):
        state, follows = _begun(), KNEE_M_S * math.atanh(500.0 / level_n)
        _step(p, state, -490.0, -0.99 * follows, level_n=level_n)
        assert state[1] == 0.0
        _step(p, state, -600.0, -follows - 0.05, level_n=level_n)
        within = 0.05 / (0.05 + 0.01 * follows)  # the part of the sample in which it is open
        assert state[1] == pytest.approx(0.5 * 0.05 * within * 1e-3, rel=0.01)


def test_a_cavity_begins_to_close_when_the_motion_turns_whatever_sign_the_force_has():
    """Behind a lag the force turns later; only once it has is it a rebound force, which is lost."""
    made, left = {}, {}
    for force_n in (-100.0, 100.0):
        s = [2e-3, 0.0, 0.0, 0.0, -0.3, 0.0, 0.0]
        made[force_n] = _step(_p(500.0, 10.0, 0.8), s, force_n, 0.3)
        left[force_n] = s[0]
    closing = np.linspace(2e-3, 1.7e-3, 101)
    assert made[100.0] == pytest.approx(100.0 * (1.0 - 0.8 * np.mean(closing / (closing + 2e-3))), rel=1e-5)
    assert made[-100.0] == pytest.approx(-100.0, rel=1e-3)
    assert left[-100.0] == pytest.approx(left[100.0], rel=1e-3)
    assert left[100.0] == pytest.approx(2e-3 - 3e-4)
    s = [2e-3, 0.0, 0.0, 0.0, -0.3, 0.0, 0.0]
    too = _step(_p(500.0, 10.0, 0.8, turning=1.0), s, -100.0, 0.3)
    assert too == pytest.approx(-made[100.0], rel=1e-3)


def test_a_leak_closes_a_cavity_that_is_to_be_lost_in_rebound_but_opens_none():
    leak, closed = 0.15, []
    for flow in (0.0, leak):
        p, state = _p(500.0, 0.5, 0.8, 1e-4, leak_m_s=flow), _begun()
        for _ in range(50):
            _step(p, state, -900.0, -0.5)
        opened = state[0]
        for _ in range(2):
            _step(p, state, 400.0, 0.1)
        closed.append((opened, opened - state[0]))
    assert closed[0][0] == closed[1][0] > 0.0
    assert closed[1][1] - closed[0][1] == pytest.approx(1.5 * leak * 1e-3)  # half of the first sample


@pytest.mark.parametrize("leak", [0.05, 2.0])
def test_a_leak_keeps_a_cavity_that_holds_small_but_the_force_at_the_limit(leak):
    """By hand: of what opens the leak fills its part, all where it is faster, and closes it the sooner."""
    p, state, dt = _p(500.0, 0.5, 0.0, 1e-6, held=1.0, leak_m_s=leak), _begun(), 1e-4
    v = -0.4 * np.sin(2.0 * np.pi * np.arange(5000) * dt)
    alone = LEVEL_N * np.tanh(v / KNEE_M_S)
    out = np.array([_step(p, state, f, u, dt_s=dt) for f, u in zip(alone, v, strict=True)])
    follows, volume, want = KNEE_M_S * math.atanh(500.0 / LEVEL_N), 0.0, np.empty(v.size)
    for k, speed in enumerate(v):
        volume = max(0.0, volume - (speed + follows + leak) * dt)
        want[k] = -500.0 if volume > 0.0 or alone[k] < -500.0 else alone[k]
    assert np.count_nonzero(want != alone) > 1000
    assert np.count_nonzero(np.abs(out - want) > 10.0) < 10


@pytest.mark.parametrize("held", [0.0, 1.0])
@pytest.mark.parametrize("rate_hz", [250, 1000])
def test_a_cavity_is_as_large_at_any_rate(held, rate_hz):
    """A velocity that stood for its whole sample would leave it half a sample's way off: 0.7 mm at 250 Hz."""
    p, sizes = _p(500.0, 2.5, 0.7, 2e-3, held=held), {}
    for rate in (20000, rate_hz):
        v = 0.4 * np.cos(2.0 * np.pi * 3.0 * np.arange(rate) / rate)
        force = LEVEL_N * np.tanh(v / KNEE_M_S)
        state = _opening(p, float(force[0]), float(v[0]))
        sizes[rate] = [
            (_step(p, state, f, u, dt_s=1.0 / rate), state[int(held)])[1]
            for f, u in zip(force, v, strict=True)
        ]
    fine, coarse = np.array(sizes[20000])[:: 20000 // rate_hz], np.array(sizes[rate_hz])
    assert np.max(fine) > 0.01
    assert np.max(np.abs(coarse - fine)) < 3e-5 * (250.0 / rate_hz) ** 2


@pytest.mark.parametrize("held", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("v", [-0.9, 0.02, 0.4])
@pytest.mark.parametrize("before", [-0.3, 0.0, 0.3])
def test_next_to_nothing_in_an_empty_cavity_goes_on_as_next_to_nothing(held, v, before):
    """Else slopes by it, carried from sample to sample, grow beyond all numbers."""
    p, little = _p(500.0, 1.0, 1.0, 0.02, held=held), 1e-9
    after = []
    for size in (0.0, little):
        state = [size, size, 0.0, 0.0, before, before, size]
        _step(p, state, LEVEL_N * math.tanh(v / KNEE_M_S), v)
        after.append(np.array(state)[[0, 1, 4, 5, 6]])
    assert np.max(np.abs(after[1] - after[0])) <= 1.01 * little


@pytest.mark.parametrize("held", [0.0, 1.0])
def test_what_is_taken_off_comes_late_by_its_lag_and_stands_at_the_start(held):
    dt, lag = 1e-4, 2e-3
    p = _p(500.0, 10.0, closing_m=1e-6, held=held)
    late = _p(*p[:9], lag)
    first = -100.0, -0.02, 0.0, 25.0, -100.0, LEVEL_N, TABLES, dt
    state = EFFECT.start(late, *first)
    assert EFFECT.step(late, state, *first) == pytest.approx(_step(p, _begun(), -100.0, -0.02, dt_s=dt))
    t = np.arange(1, 200) * dt
    made = np.array([_step(late, state, -1000.0, -0.9, dt_s=dt) for _ in t])
    assert made == pytest.approx(-1000.0 + 500.0 * (1.0 - np.exp(-t / lag)), abs=15.0)


@pytest.mark.parametrize("held", [0.0, 1.0])
def test_a_cavity_that_is_full_grows_no_more_and_closes_the_sooner(held):
    state = {}
    for most_m in (1e-3, 0.1):
        p, s = _p(300.0, 50.0, 0.5, 2e-3, held=held, most_m=most_m), _begun()
        for _ in range(100):
            _step(p, s, -2.0 * LEVEL_N, -0.5)
        grown_m = max(s[:2])
        closing = 0
        while max(s[:2]) > 0.0:
            _step(p, s, 0.5 * LEVEL_N, 0.1)
            closing += 1
        state[most_m] = grown_m, closing
    assert state[1e-3][0] == pytest.approx(1e-3)
    assert state[0.1][0] > 2e-3
    assert state[1e-3][1] < 0.5 * state[0.1][1]
