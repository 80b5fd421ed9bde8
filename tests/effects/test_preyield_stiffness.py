"""Elasticity before yield: its equations, its parts, its inverse, and the energy it may not make."""

from __future__ import annotations

import numpy as np
import pytest
from effects.equations import TABLES, relative, signals, solved, velocity
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mrctl.model.effects.registry import effects
from mrctl.model.static import force_level
from mrctl.simulate import stages


@pytest.mark.parametrize("dt_s", [0.0005, 0.002, 0.005])
def test_elasticity_before_yield_solves_its_differential_equation(dt_s):
    t, v = signals(dt_s)
    level = force_level(1.5, 45.0, TABLES)

    def backbone(u):
        return level * np.interp(velocity(u), TABLES.velocity_m_s, TABLES.shape)

    length = 1e-6 * level + 3e-4
    exact = solved(lambda u, f: abs(velocity(u)) / length * (backbone(u) - f), float(backbone(0.0)), t)
    effect = effects()["preyield_stiffness"]
    ours = stages.yielding(
        [(effect, (3e-4, 1e-6, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))],
        backbone(t),
        v,
        np.zeros(t.size),
        np.full(t.size, level),
        dt_s,
    )
    assert relative(ours, exact) < (0.01 if dt_s < 0.001 else 0.1)


def test_the_elastic_loop_depends_on_displacement_not_on_speed():
    effect, level = effects()["preyield_stiffness"], 2000.0
    loops = []
    for slow in (1.0, 4.0):
        dt = 0.0005 * slow
        t = np.arange(8000) * dt
        v = 0.3 / slow * np.cos(2.0 * np.pi * 2.0 / slow * t)
        b = level * np.sign(v)
        loops.append(
            stages.yielding(
                [(effect, (2e-4, 1e-6, 0.0, 0.7, 0.2, 0.4, 0.3, 0.0, 0.0, 0.0))],
                b,
                v,
                0.0 * v,
                np.full(t.size, level),
                dt,
            )
        )
    assert loops[0] == pytest.approx(loops[1], abs=1e-6)


@pytest.mark.parametrize("flow_s_m", [0.0, 0.6])
def test_what_flows_is_not_elastic(flow_s_m):
    """A yielding part over which Dahl's equation holds, and beside it a part that follows the velocity."""
    t, v = signals(0.0005)
    level, length = 1200.0, 6e-4

    def yields(u):
        return np.tanh(velocity(u) / 0.03)

    z = solved(lambda u, z: abs(velocity(u)) / length * (yields(u) - z), float(yields(0.0)), t)
    shape = yields(t) + flow_s_m * v
    ours = yielding(
        (length, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, flow_s_m, 0.0, 0.0), level * shape, v, level, 0.0005
    )
    assert relative(ours, level * (z + flow_s_m * v)) < 0.01


@pytest.mark.parametrize("dt_s", [0.0005, 0.002])
@pytest.mark.parametrize(("flow_s_m", "full"), [(0.0, 1.0), (0.8, 1.0), (0.8, 1.3)])
def test_behind_a_knee_it_is_a_spring_in_series_with_what_yields(flow_s_m, full, dt_s):
    """Maxwell's: dz/dt = (v - flow(z)) / length; z = tanh(flow / v0) / full is the fluid's own curve."""
    t, v = signals(dt_s)
    level, length, v0 = 1200.0, 6e-4, 0.05

    def maxwell(u, z):
        return (velocity(u) - v0 * np.arctanh(np.clip(full * z, -0.999999, 0.999999))) / length

    z = solved(maxwell, float(np.tanh(velocity(0.0) / v0) / full), t, "LSODA")
    shape = np.tanh(v / v0) / full + flow_s_m * v
    spring = (length, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, flow_s_m, 0.0)
    exact = level * (z + flow_s_m * v)
    ours, chord = (yielding((*spring, k), level * shape, v, level, dt_s) for k in (full**2, 0.0))
    assert relative(ours, exact) < (0.01 if dt_s < 0.001 else 0.04)
    assert relative(chord, exact) > 3.0 * relative(ours, exact)


def test_a_small_knee_is_hardly_any():
    _, v = signals(0.001)
    shape = np.tanh(v / 0.05) + 0.5 * v
    spring = (6e-4, 0.0, 0.7, 1.0, 0.0, 0.0, 0.0, 0.5, 0.0)
    little, none = (yielding((*spring, k), 1000.0 * shape, v, 1000.0, 0.001) for k in (1e-6, 0.0))
    assert relative(little, none) < 0.01


def test_with_creep_a_slow_fluid_relaxes_in_time_as_a_spring_in_series_does():
    effect, level, knee, length = effects()["preyield_stiffness"], 1000.0, 0.05, 5e-4
    after = []
    for v in (0.001, 0.004):  # on the straight part of g = v / knee
        force = np.full(200, level * v / knee)
        force[0] = 0.0
        out = stages.yielding(
            [(effect, (length, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))],
            force,
            np.full(200, v),
            np.zeros(200),
            np.full(200, level),
            1e-4,
        )
        after.append(out[100] / force[100])
    assert after[0] == pytest.approx(after[1], abs=1e-6)
    assert after[0] == pytest.approx(1.0 - np.exp(-0.01 * knee / length), abs=0.01)


@pytest.mark.parametrize("dt_s", [0.0005, 0.002, 0.005])
def test_the_plastic_part_before_yield_is_bouc_and_wens_beside_the_shape(dt_s):
    t, v = signals(dt_s)
    level, length, plastic = force_level(1.5, 45.0, TABLES), 1e-3, 0.3
    beside = level * np.interp(v, TABLES.velocity_m_s, TABLES.shape)

    def wen(u, z):  # A = gamma = 1 / length, beta = 0, n = 1
        return (velocity(u) - abs(velocity(u)) * z) / length

    exact = beside + plastic * level * solved(wen, np.sign(v[0]), t)
    ours = yielding((length, 0.0, 0.0, 0.0, plastic, 0.0, 0.0, 0.0, 0.0, 0.0), beside, v, level, dt_s)
    assert relative(ours, exact) < (0.002 if dt_s < 0.001 else 0.02)

    def rounded(u, z):  # A = 1 / length, beta = gamma = A / 2, n = 2
        return (velocity(u) - 0.5 * (abs(velocity(u)) * z * abs(z) + velocity(u) * z * z)) / length

    exact = beside + plastic * level * solved(rounded, np.sign(v[0]), t)
    ours = yielding((length, 0.0, 0.0, 0.0, plastic, 1.0, 0.0, 0.0, 0.0, 0.0), beside, v, level, dt_s)
    assert relative(ours, exact) < (0.002 if dt_s < 0.001 else 0.02)


def test_the_plastic_part_is_exact_for_a_velocity_that_runs_straight_over_each_sample():
    rng = np.random.default_rng(1)
    dt, fine, level, plastic = 0.002, 400, 1500.0, 0.3
    v = 0.4 * rng.standard_normal(60) * rng.integers(0, 2, 60)
    for length, compliance in ((4e-4, 0.0), (2e-4, 3e-7)):
        whole = length + compliance * level
        z, exact = np.sign(v[0]), []
        for speeds in straight(v, fine):
            for speed in speeds:  # the midpoint rule
                half = z + 0.5 * dt / fine * (speed - abs(speed) * z) / whole
                z += dt / fine * (speed - abs(speed) * half) / whole
            exact.append(plastic * level * z)
        exact = np.array(exact) - exact[0]  # the first sample begins yielded
        ours = yielding(
            (length, compliance, 0.0, 0.0, plastic, 0.0, 0.0, 0.0, 0.0, 0.0), np.zeros(v.size), v, level, dt
        )
        assert ours - ours[0] == pytest.approx(exact, abs=1e-4 * plastic * level)


def test_the_sharp_part_is_a_spring_before_friction():
    dt, level, length, plastic = 0.001, 1500.0, 2e-3, 0.3
    v = 0.12 * np.cos(12.0 * np.arange(2000) * dt + 1.0)
    at, fine, exact = 0.0, 50, []
    slider = -length  # the friction's end of the spring, which follows when the spring is at its most
    for speeds in straight(v, fine):
        for speed in speeds:
            at += speed * dt / fine
            slider = min(max(slider, at - length), at + length)
        exact.append(plastic * level * (at - slider) / length)
    ours = yielding((length, 0.0, 0.0, 0.0, plastic, 0.3, 1.0, 0.0, 0.0, 0.0), np.zeros(v.size), v, level, dt)
    assert ours == pytest.approx(exact, abs=0.01)
    assert np.ptp(ours) == pytest.approx(2.0 * plastic * level)


@pytest.mark.parametrize("sharp", [0.0, 1.0])
def test_a_force_that_is_held_as_the_current_changes_relaxes_on_the_way_alone(sharp):
    """dq/dt = K (v - |v| q / (f h)), or a spring K that slips at f h: what it holds hears of no current."""
    dt, fine, spring_n_m = 0.001, 400, 2e6
    level = np.repeat([1000.0, 400.0, 1500.0, 900.0], 60)
    v = 0.05 * np.sin(40.0 * np.arange(level.size) * dt)
    q, exact = 0.0, []
    for speeds, most in zip(straight(v, fine), level, strict=True):
        q = min(max(q, -most), most) if sharp else q
        for speed in speeds:
            rate = speed if sharp else speed - abs(speed) * q / most
            q += spring_n_m * rate * dt / fine
            q = min(max(q, -most), most) if sharp else q
        exact.append(q)
    shares = 0.0, 1.0, 0.0, sharp, 0.0, 1.0, 0.0
    ours = yielding((0.0, 1.0 / spring_n_m, 0.0, *shares), np.zeros(v.size), v, level, dt)
    assert ours == pytest.approx(exact, abs=3.0)
    strained = yielding((0.0, 1.0 / spring_n_m, 0.0, *shares[:-2], 0.0, 0.0), np.zeros(v.size), v, level, dt)
    assert np.max(np.abs(strained - exact)) > 100.0


def test_without_a_length_the_plastic_part_is_the_sign_of_the_velocity_and_nothing_at_rest():
    v = np.array([0.0, 0.0, 2.0, -2.0, -2.0, 0.0, 2.0])
    beside = 100.0 * np.sign(v)
    ours = yielding((0.0, 0.0, 0.0, 1.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0), beside, v, 1000.0, 0.001)
    assert ours == pytest.approx([0.0, 0.0, 200.0, -200.0, -200.0, -100.0, 200.0], abs=1e-5)


@settings(max_examples=100, deadline=None)
@given(
    st.floats(0.0, 5e-3), st.floats(0.0, 2e-6), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0)
)
def test_the_force_is_linear_in_the_plastic_part(length, compliance, creep, share, plastic):
    v = signals(0.001, 0.5)[1]
    beside = 1000.0 * np.tanh(v / 0.05)
    none, some, all_ = (
        yielding(
            (length, compliance, creep, share, w, share, creep, plastic, 0.0, 0.0), beside, v, 1000.0, 0.001
        )
        for w in (0.0, plastic, 1.0)
    )
    assert some == pytest.approx(none + plastic * (all_ - none), abs=1e-9)


@settings(max_examples=200, deadline=None)
@given(
    st.floats(0.0, 3e-3),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(0.02, 1.0),
    st.floats(-0.5, 0.5),
    st.floats(50.0, 3000.0),
)
def test_undoing_the_elasticity_before_yield_gives_the_wanted_force(
    length, creep, share, plastic, elastic, shape, velocity_m_s, wanted
):
    effect = effects()["preyield_stiffness"]
    p, state = (
        (length, 0.0, creep, share, plastic, share, creep, plastic, 0.0, creep),
        [
            elastic,
            shape - plastic * velocity_m_s,
            -elastic,
            elastic,
            shape,
            1000.0,
            abs(velocity_m_s),
            0.05,
            velocity_m_s,
        ],
    )
    for sign in (1.0, -1.0):
        static = effect.undo(p, list(state), sign * wanted, velocity_m_s, 0.0, 1000.0, 0.001)
        level = static / shape
        if level > 0.0:  # else no current makes a force of this sign
            made = effect.step(p, list(state), static, velocity_m_s, 0.0, level, 0.001)
            if level * shape < 4.99 * wanted:
                assert made == pytest.approx(sign * wanted, rel=1e-9)
            else:
                assert -1e-9 * wanted <= sign * made <= wanted * (1.0 + 1e-9)  # but for rounding


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.0, 5e-3),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(0.02, 0.8),
    st.sampled_from([1.0, 2.0, 5.0]),
)
def test_the_elasticity_before_yield_takes_energy_out_of_closed_cycles(
    length, creep, share, plastic, speed, frequency_hz
):
    dt, cycle = 0.001, round(1000.0 / frequency_hz)
    v = speed * np.sin(2.0 * np.pi * frequency_hz * dt * np.arange(6 * cycle))
    made = yielding(
        (length, 0.0, creep, share, plastic, creep, share, 0.0, 0.0, share),
        1000.0 * np.tanh(v / 0.1),
        v,
        1000.0,
        dt,
    )
    assert np.sum(made[-cycle:] * v[-cycle:]) >= 0.0


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.0, 5e-3),
    st.lists(st.floats(-0.8, 0.8), min_size=2, max_size=40),
    st.sampled_from([0.0, 1.0]),
    st.sampled_from([0.0, 1.0]),
)
def test_the_plastic_part_takes_energy_out_whatever_the_motion(length, motion, rounded, sharp):
    """But for what it stored before: at most half a length's work, as of a spring."""
    v, dt = np.array(motion), 0.001
    made = yielding((length, 0.0, 0.0, 0.0, 1.0, rounded, sharp, 0.0, 0.0, 0.0), np.zeros(v.size), v, 1.0, dt)
    assert np.sum(made * v) * dt >= -0.5 * max(length, 1e-5) - 1e-12


@pytest.mark.parametrize("rate_hz", [1000.0, 2000.0])
def test_a_spring_in_series_flows_at_rest_too_and_is_followed_to_second_order(rate_hz):
    """Samples at rest, where both speed and shape are 0, must not stop the flow behind the spring."""
    stiffness_n_m, knee_m_s, level_n, speed_m_s, w = 3e6, 0.05, 1500.0, 0.12, 2.0 * np.pi * 5.0
    t = np.arange(round(0.6 * rate_hz)) / rate_hz
    v = speed_m_s * np.sin(w * t)
    v[np.abs(v) < 1e-12] = 0.0
    assert np.count_nonzero(v == 0.0) > 5

    def spring(u, z):
        return stiffness_n_m / level_n * (speed_m_s * np.sin(w * u) - knee_m_s * np.arctanh(z))

    true = (
        level_n * solve_ivp(spring, (0.0, t[-1]), [0.0], t_eval=t, rtol=1e-9, atol=1e-11, max_step=1e-3).y[0]
    )
    static = level_n * np.tanh(v / knee_m_s)
    p = (0.0, 1.0 / stiffness_n_m, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    made = yielding(p, static, v, level_n, 1.0 / rate_hz)
    error = float(np.sqrt(np.mean((made - true) ** 2) / np.mean((static - true) ** 2)))
    assert error < 3e-3 * (1000.0 / rate_hz) ** 2


def straight(v, fine):
    """For each sample the speeds in the middle of so many parts of it, straight from the one before."""
    before = np.concatenate([v[:1], v[:-1]])
    share = (np.arange(fine) + 0.5) / fine
    return (1.0 - share) * before[:, None] + share * v[:, None]


def yielding(p, force_n, v, level_n, dt_s):
    effect = effects()["preyield_stiffness"]
    return stages.yielding([(effect, p)], force_n, v, 0.0 * v, np.broadcast_to(level_n, v.shape).copy(), dt_s)
