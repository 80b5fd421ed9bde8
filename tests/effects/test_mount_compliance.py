"""A mount in series follows its differential equation, and carries what the damper gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effects.conftest import make_damper, with_effects
from effects.contract import by_sample
from effects.equations import TABLES, T, relative, signals, velocity
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from mrctl.model.effects.registry import effects
from mrctl.model.filters import first_order, plain_lag
from mrctl.model.static import backbone_force, force_level
from mrctl.simulate import Run, stages, trace

NO_LAG = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("dt_s", [0.0005, 0.002, 0.005])
@pytest.mark.parametrize("stiffness_n_m", [5e5, 1.6e6, 5e6])
@pytest.mark.parametrize(("hardening", "arm"), [(0.0, 0.0), (0.5, 0.0), (0.5, 0.8)])
def test_mount_compliance_solves_its_differential_equation_at_every_rate_and_stiffness(
    dt_s, stiffness_n_m, hardening, arm
):
    t, v = signals(dt_s)
    current, warm, damping = np.full(t.size, 1.5), np.full(t.size, 45.0), 1000.0
    mount = effects()["mount_compliance"]
    level = force_level(1.5, 45.0, TABLES)
    # By that share where the damper's force would bend a plain spring to.
    per_m2 = hardening * (stiffness_n_m / level) ** 2
    creep_s = 0.03
    p = (1.0 / stiffness_n_m, damping, per_m2, 1.0, arm, creep_s, 0.0)
    v1, x1 = stages.piston_motion([(mount, p)], v, np.zeros(t.size), current, warm, TABLES, NO_LAG, dt_s)

    # f h g(v1) + c v1 = k y (1 + hardening y^2) + c v + z: its left side increases with v1, knot by knot.
    knots = np.array(TABLES.velocity_m_s)
    left = level * np.array(TABLES.shape) + damping * knots

    def rates(u, state):
        y, z = state
        bends = velocity(u) - np.interp(spring(y) + z + damping * velocity(u), left, knots)
        return bends, arm * stiffness_n_m * bends - z / creep_s

    def spring(y):
        return stiffness_n_m * y * (1.0 + per_m2 * y * y)

    first_n = backbone_force(float(v[0]), 1.5, 45.0, TABLES)
    y0 = brentq(lambda y: spring(y) - first_n, -1.0, 1.0)
    exact = solve_ivp(rates, (0.0, T), [y0, 0.0], t_eval=t, method="LSODA", rtol=1e-6, atol=1e-9).y[0]
    assert relative(-x1, exact) < (5e-3 if dt_s < 0.001 else 4e-2)
    assert np.all(np.abs(v1) <= np.max(np.abs(v)) + 2.0 * level / stiffness_n_m / dt_s)


def test_the_mount_carries_what_the_damper_gives_behind_a_lag_as_long_as_its_own():
    t, v = signals(0.001)
    run = Run.of(0.001, v, 1.5, 45.0, np.zeros(t.size))
    made = trace(
        run, with_effects(make_damper(), mount_compliance={"compliance_m_n": 5e-7, "damping_n_s_m": 0.0})
    )
    lag = plain_lag(make_damper().forward_filter.resampled(1000.0).coefficients)
    carried = stages.filtered(made.static_n, lag, settled=True)
    assert -made.displacement_m / 5e-7 == pytest.approx(carried, abs=1e-6 * np.max(np.abs(carried)))


@pytest.mark.parametrize("share", [0.0, 0.4])
def test_the_part_of_the_lag_that_is_the_load_cells_does_not_bend_the_mount(share):
    t, v = signals(0.001)
    run = Run.of(0.001, v, 1.5, 45.0, np.zeros(t.size))
    mount = {"compliance_m_n": 5e-7, "damping_n_s_m": 0.0, "lag_inside": share}
    made = trace(run, with_effects(make_damper(), mount_compliance=mount))
    lag = plain_lag(make_damper().forward_filter.resampled(1000.0).coefficients)
    samples = share * (1.0 / lag[0] - 1.0)
    first = (1.0 / (1.0 + samples), 0.0, 0.0, 0.0, -samples / (1.0 + samples), 0.0, 0.0)
    carried = stages.filtered(made.static_n, first, settled=True)
    assert -made.displacement_m / 5e-7 == pytest.approx(carried, abs=1e-6 * np.max(np.abs(carried)))


def test_what_bends_the_mount_may_come_behind_two_lags():
    t, v = signals(0.001)
    run = Run.of(0.001, v, 1.5, 45.0, np.zeros(t.size))
    mount = {"compliance_m_n": 5e-7, "damping_n_s_m": 0.0, "lag_split": 0.3}
    made = trace(run, with_effects(make_damper(), mount_compliance=mount))
    samples = 1.0 / plain_lag(make_damper().forward_filter.resampled(1000.0).coefficients)[0] - 1.0
    carried = made.static_n
    for share in (0.3, 0.7):
        carried = stages.filtered(carried, first_order(share * samples), settled=True)
    assert -made.displacement_m / 5e-7 == pytest.approx(carried, abs=1e-6 * np.max(np.abs(carried)))


@pytest.mark.parametrize("damping_n_s_m", [0.0, 3e3])
@pytest.mark.parametrize("dt_s", [0.0005, 0.002])
def test_two_lags_leave_the_mount_at_rest_however_steep_the_damper_is(damping_n_s_m, dt_s):
    """Three need not: what has come to rest would go on for ever, to and fro."""
    t = np.arange(0.0, 4.0, dt_s)
    v = np.where(t < 1.0, 0.2 * np.sin(20.0 * t), 0.0)
    samples = 0.03 / dt_s
    for stiffness_n_m, level in ((1e5, 10.0), (1e5, 100.0), (1e6, 100.0)):
        mount = effects()["mount_compliance"], (1.0 / stiffness_n_m, damping_n_s_m, 0.0, 1.0, 0.0, 0.02, 0.5)
        steep = TABLES._replace(force_n=tuple(level * x for x in TABLES.force_n))
        _, x1 = stages.piston_motion(
            [mount], v, np.zeros(t.size), np.full(t.size, 1.5), np.full(t.size, 45.0), steep,
            first_order(samples), dt_s,
        )  # fmt: skip
        last = x1[t > 2.0]  # by now it creeps back, and does nothing else
        assert np.sum(np.abs(np.diff(last))) <= np.ptp(last) + 1e-6 * np.ptp(x1)


@pytest.mark.parametrize(("dt_s", "stiffness_n_m"), [(0.0005, 5e5), (0.002, 2e6)])
def test_the_mount_carries_all_that_the_piston_feels(dt_s, stiffness_n_m):
    t, v = signals(dt_s)
    x, a = stroke(t), np.gradient(v, dt_s)
    friction_n, presliding_m, gas_n_m, viscous, softer_per_m = 150.0, 3e-4, 2e4, 3e3, 12.0
    beside = [
        (effects()["viscous_damping"], (viscous, 0.0, 0.0, 0.0)),
        (effects()["gas_spring"], (0.0, gas_n_m, 0.0, 0.0)),
        (effects()["coulomb_friction"], (friction_n, presliding_m, 0.0, 5e-3, 0.0, 0.0)),
    ]
    mount = effects()["mount_compliance"], (1.0 / stiffness_n_m, 500.0, 0.0, 1.0, 0.0, 0.02, 0.0)
    bypass = replace(effects()["stroke_dependent_damping"], step=_softer, parameters=(_SOFTER,), start=None)
    current, warm = np.full(t.size, 0.5), np.full(t.size, 45.0)
    _, x1 = stages.piston_motion(
        [mount], v, x, current, warm, TABLES, NO_LAG, dt_s, None, a, [(bypass, (softer_per_m,))], beside
    )

    level = force_level(0.5, 45.0, TABLES)
    knots, shape = np.array(TABLES.velocity_m_s), np.array(TABLES.shape)

    def piston(u, y, z):
        held = stiffness_n_m * y + 500.0 * velocity(u) - gas_n_m * (stroke(u) - y) - friction_n * z
        factor = 1.0 + softer_per_m * (stroke(u) - y)
        return np.interp(held, factor * level * shape + (500.0 + viscous) * knots, knots)

    def rates(u, state):
        y, z = state
        v1 = piston(u, y, z)
        return velocity(u) - v1, (1.0 - z * np.sign(v1)) * v1 / presliding_m

    first_n = level * np.interp(v[0], knots, shape) + viscous * v[0] + gas_n_m * x[0] + friction_n
    start = first_n / stiffness_n_m, np.sign(v[0])
    exact = solve_ivp(rates, (0.0, T), start, t_eval=t, method="LSODA", rtol=1e-6, atol=1e-9).y[0]
    settled = t > 0.2
    assert relative((x - x1)[settled], exact[settled]) < (5e-3 if dt_s < 0.001 else 4e-2)


_SOFTER = effects()["stroke_dependent_damping"].parameters[0]


def _softer(p, s, velocity_m_s, displacement_m, current_a, temperature_c, dt_s):  # noqa: ARG001 - the stage's
    return 1.0 + p[0] * displacement_m


def sharp(dt_s):
    """A friction of next to no length beside a soft mount without damping."""
    t, v = signals(dt_s)
    friction = {"friction_n": 500.0, "presliding_m": 1e-6}
    mount = {"compliance_m_n": 2e-6, "damping_n_s_m": 0.0}
    damper = with_effects(make_damper(), mount_compliance=mount, coulomb_friction=friction)
    return damper, Run.of(dt_s, v, 0.3, 45.0, stroke(t))


def test_a_friction_turns_with_the_piston_where_the_mount_lets_it():
    fine, coarse = (run.displacement_m - trace(run, d).displacement_m for d, run in map(sharp, (5e-5, 1e-3)))
    assert relative(coarse[200:], fine[::20][200 : coarse.size]) < 0.03
    assert float(np.max(np.abs(coarse))) < 1.2 * float(np.max(np.abs(fine)))


def test_on_the_vehicle_it_turns_alike():
    damper, run = sharp(1e-3)
    desk = trace(run, damper).force_n
    assert by_sample(damper, run) == pytest.approx(desk, abs=1e-9 * float(np.max(np.abs(desk))))


def test_a_gas_preload_does_not_move_the_piston():
    t, v = signals(0.001)
    run = Run.of(0.001, v, 1.5, 45.0, stroke(t))
    mount = {"compliance_m_n": 5e-6, "damping_n_s_m": 0.0}
    gas = {"stiffness_n_m": 8e3, "progression_per_m": 0.0}
    without, pressed = (
        trace(run, with_effects(make_damper(), mount_compliance=mount, gas_spring={"preload_n": by_n, **gas}))
        for by_n in (0.0, -900.0)
    )
    assert pressed.displacement_m == pytest.approx(without.displacement_m, abs=1e-12)


def test_a_load_cells_zero_does_not_bend_the_mount():
    t, v = signals(0.001)
    run = Run.of(0.001, v, 1.5, 45.0, np.zeros(t.size))
    mount = {"compliance_m_n": 5e-7, "damping_n_s_m": 0.0}
    alone = trace(run, with_effects(make_damper(), mount_compliance=mount))
    with_zero = with_effects(make_damper(), mount_compliance=mount, force_offset={"offset_n": 200.0})
    assert np.array_equal(trace(run, with_zero).displacement_m, alone.displacement_m)


def stroke(t):
    return -0.25 / 9.0 * np.cos(9.0 * t) - 0.1 / 31.0 * np.cos(31.0 * t + 0.5)


def test_a_mount_that_does_not_give_way_has_no_arm_either():
    """A fit may take the compliance to 0 while the arm is there."""
    rigid = effects()["mount_compliance"].gives_way.step
    state = [0.0] * 6
    assert rigid((0.0, 1e3, 0.0, 1.0, 0.5, 0.02, 0.0), state, 100.0, 1e3, 1e4, 0.0, NO_LAG, 1e-3) == (
        0.0,
        0.0,
    )
