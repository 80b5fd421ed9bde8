"""Each effect follows its equation, by an independent solution of it, and keeps the laws it must."""

from __future__ import annotations

import numpy as np
import pytest
from effects.equations import TABLES, T, relative, signals, solved, velocity
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import curve_fit
from scipy.signal import lsim

from mrctl.model.effects.base import Ranges
from mrctl.model.effects.registry import effects
from mrctl.model.static import backbone_force
from mrctl.simulate import stages


@pytest.mark.parametrize("dt_s", [0.0005, 0.002, 0.005])
@pytest.mark.parametrize("saturation", [0.0, 0.5])
def test_current_lag_solves_its_differential_equation(dt_s, saturation):
    t = np.arange(round(T / dt_s) + 1) * dt_s

    def command(u):
        return 1.5 + np.sin(12.0 * u) + 0.4 * np.sin(40.0 * u)

    def rate(u, y):
        tau = 0.008 if command(u) > y[0] else 0.02
        return (command(u) - y) * (1.0 + saturation * np.abs(y)) / tau

    lag = effects()["current_lag"]
    ours = stages.field_current([(lag, (0.008, 0.02, saturation))], command(t), dt_s)
    assert relative(ours, solved(rate, command(0.0), t)) < 3e-3


@pytest.mark.parametrize("dt_s", [0.0005, 0.005])
def test_friction_is_dahls(dt_s):
    t, v = signals(dt_s)
    ours = additive("coulomb_friction", (80.0, 5e-4, 0.0, 5e-3, 0.0, 0.0), t, v, dt_s)
    exact = 80.0 * solved(
        lambda u, z: velocity(u) / 5e-4 * (1.0 - z * np.sign(velocity(u))), np.sign(v[0]), t
    )
    assert relative(ours, exact) < (0.01 if dt_s < 0.001 else 0.1)


def test_fast_friction_is_coulombs():
    t, v = signals(0.0005)
    ours = additive("coulomb_friction", (80.0, 1e-5, 0.0, 5e-3, 0.0, 0.0), t, v, 0.0005)
    moving = np.abs(v) > 0.1
    assert ours[moving] == pytest.approx(80.0 * np.sign(v[moving]), abs=0.1)


def test_slow_friction_is_stribecks():
    t = np.arange(8000) * 0.0005
    v = 0.02 * t / t[-1]
    ours = additive("coulomb_friction", (80.0, 1e-6, 0.25, 4e-3, 0.0, 0.0), t, v, 0.0005)
    sliding = v > 1e-3
    assert ours[sliding] == pytest.approx(80.0 + 20.0 * np.exp(-((v[sliding] / 4e-3) ** 2)), rel=1e-3)


def test_friction_inside_a_chamber_follows_with_a_swing():
    t, v = signals(0.0005)
    plain = additive("coulomb_friction", (80.0, 1e-4, 0.2, 4e-3, 0.0, 0.0), t, v, 0.0005)
    late = additive("coulomb_friction", (80.0, 1e-4, 0.2, 4e-3, 6e-3, 0.5), t, v, 0.0005)
    exact = lsim(([1.0], [0.5 * 6e-3**2, 6e-3, 1.0]), plain - plain[0], t)[1] + plain[0]
    assert relative(late, exact) < 0.03
    assert relative(plain, exact) > 0.1


def test_inertia_lags_as_a_chamber_lets_it():
    t, v = signals(0.0005)
    a, zeros = np.gradient(v, t), np.zeros(t.size)
    late = stages.additive(effects()["fluid_inertia"], (10.0, 20e-3), v, zeros, a, zeros, zeros, 0.0005)
    span = 10.0 * float(np.ptp(a))
    assert late + 20e-3 * np.gradient(late, t) == pytest.approx(10.0 * a, abs=0.02 * span)
    assert float(np.max(np.abs(late - 10.0 * a))) > 0.1 * span


def test_self_heating_solves_its_energy_balance():
    dt, p = 0.01, (2e-3, 40.0, 2.0, 0.0)
    t = np.arange(6000) * dt
    v, current = 0.2 * np.sin(5.0 * t), np.full(t.size, 1.5)
    fluid = stages.fluid_temperature(
        [(effects()["self_heating"], p)], np.full(t.size, 30.0), v, current, TABLES, dt
    )

    def rate(u, y):
        speed = 0.2 * np.sin(5.0 * u)
        power = backbone_force(speed, 1.5, 30.0 + y[0], TABLES) * speed + 2.0 * 1.5**2
        return 2e-3 * power - y / 40.0

    exact = solve_ivp(rate, (0.0, t[-1]), [0.0], t_eval=t, rtol=1e-7, atol=1e-9, max_step=0.02).y[0]
    assert fluid - 30.0 == pytest.approx(exact, abs=0.02 * np.max(exact))
    assert np.max(exact) > 5.0


def test_the_gas_spring_covers_accumulators_of_any_exponent():
    area, volume, pressure = 2e-4, 6e-5, 2e6
    x = np.linspace(-0.05, 0.05, 101)
    for kappa in (1.0, 1.2, 1.4):
        exact = -pressure * area * (volume / (volume + area * x)) ** kappa
        p = (
            -pressure * area,
            pressure * area * kappa * area / volume,
            -(kappa + 1.0) * area / (2.0 * volume),
            0.0,
        )
        ours = np.array([effects()["gas_spring"].step(p, [], 0.0, u, 0.0, 0.0, 0.0, 0.001) for u in x])
        assert ours == pytest.approx(exact, abs=0.004 * np.ptp(exact))


def test_a_direction_that_saturates_later_is_asymmetric_at_any_current():
    def rebound(i):
        return 140.0 + 1500.0 * (1.0 - np.exp(-i / 1.1))

    def compression(i):
        return 140.0 + 850.0 * (1.0 - np.exp(-i / 0.45))

    i = np.linspace(0.0, 2.0, 41)
    want = compression(i) / rebound(i)  # it rises at first, and falls then

    def ratio(i, *p):
        step = effects()["rebound_asymmetry"].step
        return np.array([step(p, [], -0.1, 0.0, one, 40.0, 0.001) for one in i])

    p, _ = curve_fit(
        ratio,
        i,
        want,
        p0=(0.0, 2.0, 2.0, -2.0, 1.0, 0.0),
        bounds=([-9.0, -50.0, 0.0, -500.0, 1.0, -50.0], [9.0, 50.0, 100.0, 500.0, 6.0, 50.0]),
    )
    assert np.max(np.abs(ratio(i, *p) - want)) < 0.015


def test_compression_with_a_force_of_its_own_without_current_too_is_an_asymmetry():
    """What the ratio of two such curves does is over at small currents, and goes on slowly from there."""
    i = np.linspace(0.0, 1.2, 61)
    rebound = 12.0 + 140.0 * np.tanh(i / 0.5)
    compression = 24.0 + 105.0 * i**1.5 / (i**1.5 + 0.5**1.5)

    def force(i, *p):
        step = effects()["rebound_asymmetry"].step
        return rebound * np.array([step(p, [], -0.1, 0.0, one, 40.0, 0.001) for one in i])

    p, _ = curve_fit(
        force,
        i,
        compression,
        p0=(1.0, -25.0, 18.0, 0.0, 1.0, 0.0),
        bounds=([-9.0, -50.0, 0.0, -500.0, 1.0, -50.0], [9.0, 50.0, 100.0, 500.0, 6.0, 50.0]),
    )
    assert np.max(np.abs(force(i, *p) - compression)) < 0.005 * compression.max()


def test_an_asymmetry_that_sets_in_late_and_then_levels_off_is_one():
    step, i = effects()["rebound_asymmetry"].step, np.linspace(0.0, 2.0, 41)
    want = 1.0 - 0.36 * np.tanh(i / 0.7) ** 2

    def factor(i, at_once, late, bend, sharpness):
        p = (0.0, at_once, bend, late, sharpness, 0.0)
        return np.array([step(p, [], -0.1, 0.0, one, 40.0, 0.001) for one in i])

    begin, ends = (0.0, -0.3, 1.0, 2.0), ([-50.0, -500.0, 0.0, 1.0], [50.0, 500.0, 100.0, 6.0])
    p, _ = curve_fit(factor, i, want, p0=begin, bounds=ends)
    assert np.max(np.abs(factor(i, *p) - want)) < 0.005


def test_warm_gas_presses_harder():
    step = effects()["gas_spring"].step
    p = (-200.0, 5000.0, 0.0, -200.0 / 298.15)
    cold, warm = (step(p, [], 0.0, 0.01, 0.0, 0.0, c, 0.001) for c in (25.0, 84.63))
    assert warm - cold == pytest.approx(-200.0 * 0.2)


@pytest.mark.parametrize("delay_s", [0.0, 0.0002, 0.0005, 0.0012, 0.0031, 0.02])
def test_sensor_delay_delays_by_fractions_of_a_sample(delay_s):
    t = np.arange(4000) * 0.0005
    ours = stages.measured([(effects()["sensor_delay"], (delay_s,))], np.sin(60.0 * t), 0.0005)
    assert ours[50:] == pytest.approx(np.sin(60.0 * (t[50:] - delay_s)), abs=2e-6)


def test_sensor_delay_is_continuous_in_the_delay():
    t = np.arange(400) * 0.001
    force = np.sin(60.0 * t)
    for delay in (0.001, 0.002, 0.003):
        below, above = (
            stages.measured([(effects()["sensor_delay"], (delay + e,))], force, 0.001) for e in (-1e-9, 1e-9)
        )
        assert below == pytest.approx(above, abs=1e-6)


@settings(max_examples=300, deadline=None)
@given(
    st.floats(-0.1, 0.1), st.floats(-2.0, 2.0), st.floats(0.0, 0.08), st.floats(1.0, 3.0), st.floats(0.0, 5e4)
)
def test_an_end_stop_pushes_back_and_never_pulls(x, v, clearance, exponent, damping):
    p = clearance, 500.0, exponent, damping, 0.0, 0.0
    force, stiffer = (
        effects()["end_stop"].step((*p, change), [0.0], v, x, 0.0, 0.0, 0.0, 0.001) for change in (0.0, 0.5)
    )
    assert stiffer == pytest.approx(force * (1.5 if x < 0.0 else 1.0))
    assert force * x >= 0.0
    if abs(x) <= clearance:
        assert force == 0.0


def test_a_damping_that_lags_is_late_by_its_time_constant_and_no_smaller():
    t, dt = np.arange(4000) * 1e-3, 1e-3
    v = 0.3 * np.sin(2.0 * np.pi * t)
    zeros = np.zeros(t.size)
    for name, before, after in (
        ("viscous_damping", (400.0, 0.0), (0.0,)),
        ("quadratic_damping", (900.0,), (0.5,)),
    ):
        rest = zeros, zeros, zeros + 1.0, zeros + 40.0, dt
        plain, late = (
            stages.additive(effects()[name], (*before, lag, *after), v, *rest) for lag in (0.0, 8e-3)
        )
        tolerance = 4e-3 * np.abs(plain).max()
        assert late[2000:] == pytest.approx(np.interp(t - 8e-3, t, plain)[2000:], abs=tolerance)


@pytest.mark.parametrize(("flatness", "halfway"), [(1.0, 1.08), (4.0, 1.0016)])
def test_a_groove_off_the_middle_changes_the_damping_there_alone(flatness, halfway):
    """One with a flat middle leaves it as it is there, up to its edge."""
    step = effects()["stroke_dependent_damping"].step
    p = (0.0, 0.4 * 1e4, 1e4, 0.02, flatness, 1.0)  # 10 mm wide, at 20 mm
    factors = [step(p, [], 0.1, x, 1.0, 40.0, 0.001) for x in (0.02, 0.025, 0.03, -0.08)]
    assert factors == pytest.approx([1.0, halfway, 1.2, 1.4], abs=0.01)


def test_a_groove_ends_as_its_tail_says():
    """As exp(-w) without one; 0.02 of it is a hundredth of w from that, and 1 is w / (1 + w)."""
    step, x_m = effects()["stroke_dependent_damping"].step, np.linspace(-0.03, 0.03, 61)
    w = (x_m / 0.01) ** 4
    for tail, levelled, off in (
        (0.0, -np.expm1(-w), 1e-9),
        (0.02, -np.expm1(-w), 3e-3),
        (1.0, w / (1 + w), 1e-9),
    ):
        p = (0.0, 0.4 * 1e4, 1e4, 0.0, 2.0, tail)
        factors = np.array([step(p, [], 0.1, x, 1.0, 40.0, 0.001) for x in x_m])
        assert np.max(np.abs(factors - 1.0 - 0.4 * levelled)) <= off
        assert tail in (0.0, 1.0) or not np.allclose(factors - 1.0, 0.4 * levelled, atol=1e-4)


def test_a_taper_that_does_not_level_off_is_of_second_order_whatever_its_flatness():
    step = effects()["stroke_dependent_damping"].step
    for flatness in (1.0, 3.0):
        p = (3.0, 200.0, 0.0, 0.0, flatness, 0.3)
        assert step(p, [], 0.1, -0.02, 1.0, 40.0, 0.001) == pytest.approx(1.0 - 0.06 + 0.08)


@pytest.mark.parametrize("law_k", [95.0, 273.15])
def test_a_damping_thins_as_vogel_has_it(law_k):
    """exp(b / (T + c)), with Cameron's c or Arrhenius': relative to 40 degC, where the loss is stated."""
    step, at = effects()["viscous_damping"].step, law_k + 40.0
    p = (400.0, 0.03, 0.0, 1.0 / at)
    for celsius in (-10.0, 2.0, 39.0, 90.0):
        exact = 400.0 * np.exp(0.03 * at**2 * (1.0 / (celsius + law_k) - 1.0 / at))
        assert step(p, [0.0], 1.0, 0.0, 0.0, 1.0, celsius, 0.001) == pytest.approx(exact)


@settings(max_examples=200, deadline=None)
@given(st.floats(-2.0, 2.0), st.floats(-40.0, 150.0))
def test_damping_effects_take_energy_out(v, temperature):
    for name in ("viscous_damping", "quadratic_damping"):
        effect = effects()[name]
        assert effect.step(effect.typical, [0.0], v, 0.0, 0.0, 1.0, temperature, 0.001) * v >= 0.0


def additive(name, p, t, v, dt_s):
    zeros = np.zeros(t.size)
    return stages.additive(effects()[name], p, v, zeros, zeros, zeros + 1.0, zeros + 40.0, dt_s)


@pytest.mark.parametrize(
    ("fade_a", "largest_a", "is_one"),
    [(0.34, 2.5, True), (0.71, 2.5, True), (0.34, 0.4, False), (1.0, 2.0, False)],
)
def test_an_off_state_is_over_below_the_currents_at_which_a_damper_is_on(fade_a, largest_a, is_one):
    effect = effects()["off_state_backbone"]
    reach = Ranges(displacement_m=0.03, velocity_m_s=0.5, current_a=largest_a, force_n=2000.0)
    assert effect.plausible is not None
    assert effect.plausible((-0.5, 1.0, 0.1, fade_a), reach) is is_one


@pytest.mark.parametrize(
    ("velocity_m_s", "current_a", "factor"),
    [(-0.3, 0.0, 0.8), (-0.3, 0.2, 0.9), (-0.3, 0.4, 1.0), (0.3, 0.0, 1.0)],
)
def test_near_0_a_compression_may_have_another_share_of_the_force(velocity_m_s, current_a, factor):
    step = effects()["off_state_backbone"].step
    assert step(
        (0.0, 0.0, 0.1, 0.4, 1.0, -0.2), [], velocity_m_s, 0.0, current_a, 30.0, 1e-3
    ) == pytest.approx(factor)


@pytest.mark.parametrize(
    ("preload_n", "stiffness_n_m", "is_one"),
    [(0.0, 800.0, True), (-150.0, 900.0, True), (-17.5, 1.5, False), (40.0, 0.0, False)],
)
def test_a_gas_spring_rises_with_stroke(preload_n, stiffness_n_m, is_one):
    effect = effects()["gas_spring"]
    assert effect.plausible is not None
    assert effect.plausible((preload_n, stiffness_n_m, 0.0, 0.0), Ranges(0.03, 0.5, 2.0, 1e3)) is is_one


@pytest.mark.parametrize(("p", "is_one"), [((3e-3, 60.0), True), ((0.0, 60.0), False), ((0.2, 2.0), False)])
def test_what_cools_as_fast_as_may_be_is_no_warmth(p, is_one):
    effect = effects()["self_heating"]
    assert effect.plausible is not None
    assert effect.plausible((*p, 2.0, 5.0), Ranges(0.03, 0.5, 2.0, 1e3)) is is_one


def test_a_gas_column_is_told_where_there_is_one():
    """From a spring that is as good as straight no length is to be read."""
    derived = effects()["gas_spring"].derived
    assert derived((0.0, 8e3, -5.0, 0.0))["isothermal gas column V0/A"] == (pytest.approx(0.2), "m")
    assert derived((0.0, 8e3, 0.07, 0.0)) == {}
    assert derived((0.0, 8e3, 0.0, 0.0)) == {}
