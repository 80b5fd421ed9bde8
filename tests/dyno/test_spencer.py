"""Spencer's damper: known limits of its equations, an independent integrator, the dyno it stands on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mrctl.measurements import check_campaign
from mrctl.model.baselines import bouc_wen
from mrctl.model.baselines.bouc_wen import LARGEST_V, SPENCER_1997
from mrctl.plant.dyno.campaign import Bench
from mrctl.plant.spencer import simulate_bouc_wen

RATE_HZ = 2000.0
OMEGA = 5.0 * math.pi
AMPLITUDE_M = 0.024


def motion(cycles=4, amplitude_m=AMPLITUDE_M, omega=OMEGA, rate_hz=RATE_HZ):
    t = np.arange(round(2 * math.pi / omega * cycles * rate_hz) + 1) / rate_hz
    return amplitude_m * np.sin(omega * t), amplitude_m * omega * np.cos(omega * t)


def test_the_published_numbers_are_converted_to_si():
    p = SPENCER_1997
    assert p.gamma == p.beta == pytest.approx(3.63e6)  # 363 cm^-2; not 363e-4
    assert p.c0_a_n_s_m == pytest.approx(2100.0)
    assert p.k1_n_m * p.x0_m == pytest.approx(5.0 * 14.3)
    assert p.alpha_b_n_m == pytest.approx(69500.0)


@pytest.mark.parametrize("volts", [0.0, 1.5, LARGEST_V])
def test_it_agrees_with_an_independent_integrator(volts):
    t = np.arange(1601) / RATE_HZ
    x, v = motion(2)

    def slope(at, state):
        return bouc_wen.rates(
            SPENCER_1997,
            volts,
            *state,
            AMPLITUDE_M * math.sin(OMEGA * at),
            AMPLITUDE_M * OMEGA * math.cos(OMEGA * at),
        )

    found = solve_ivp(slope, (0.0, t[-1]), [0.0, 0.0], "LSODA", t, rtol=1e-9, atol=1e-13, max_step=1e-3).y
    expected = [
        bouc_wen.force(SPENCER_1997, volts, *s, a, b)
        for s, a, b in zip(found.T, x[:1601], v[:1601], strict=True)
    ]
    ours = simulate_bouc_wen(SPENCER_1997, RATE_HZ, x[:1601], v[:1601], volts)
    assert np.max(np.abs(ours - expected)) < 0.05


def test_a_tenth_of_the_tolerance_does_not_change_the_force():
    x, v = motion()
    coarse = simulate_bouc_wen(SPENCER_1997, RATE_HZ, x, v, 1.5)
    fine = simulate_bouc_wen(SPENCER_1997, RATE_HZ, x, v, 1.5, relative=1e-9)
    assert np.max(np.abs(fine - coarse)) < 0.01


@given(st.floats(0.0, LARGEST_V), st.floats(0.005, 0.024), st.floats(1.0, 40.0))
@settings(max_examples=25, deadline=None)
def test_it_takes_energy_over_a_whole_cycle(volts, amplitude_m, omega):
    x, v = motion(3, amplitude_m, omega)
    force = simulate_bouc_wen(SPENCER_1997, RATE_HZ, x, v, volts)
    last = slice(-round(2 * math.pi / omega * RATE_HZ) - 1, None)
    assert np.trapezoid(force[last], x[last]) > 0.0


def test_its_loop_is_symmetric_about_the_accumulators_force():
    x, v = motion(80)  # y settles within (c0 + c1) / k0, some seconds
    half = round(math.pi / OMEGA * RATE_HZ)
    force = simulate_bouc_wen(SPENCER_1997, RATE_HZ, x, v, 1.5) + SPENCER_1997.k1_n_m * SPENCER_1997.x0_m
    assert np.max(np.abs(force[-half:] + force[-2 * half : -half])) < 1.0


def test_slow_motion_leaves_the_yield_force_and_the_springs():
    x, v = motion(2, 0.02, 0.02 * math.pi, 50.0)
    p = SPENCER_1997
    yielded = math.sqrt(p.a / (p.gamma + p.beta))
    for volts in (0.0, 2.0):
        force = simulate_bouc_wen(p, 50.0, x, v, volts)
        top = np.argmax(v[len(v) // 2 :]) + len(v) // 2
        friction = (p.alpha_a_n_m + p.alpha_b_n_m * volts) * yielded
        c1 = p.c1_a_n_s_m + p.c1_b_n_s_m * volts
        # k0 (x - y): y drifts at friction / c1, which is as fast as x here; then c1 carries all of it.
        assert force[top] + p.k1_n_m * p.x0_m < friction + p.k0_n_m * 0.02 + p.c0_a_n_s_m * v[top] + 1.0
        assert force[top] + p.k1_n_m * p.x0_m == pytest.approx(min(c1 * v[top], friction), abs=10.0)


def test_the_drive_acts_behind_a_lag_of_its_own():
    x, v = motion(8)
    volts = np.where(np.arange(x.size) < x.size // 2, 0.0, 2.0)
    sudden = simulate_bouc_wen(SPENCER_1997._replace(eta_1_s=1e6), RATE_HZ, x, v, volts)
    lagged = simulate_bouc_wen(SPENCER_1997, RATE_HZ, x, v, volts)
    step = x.size // 2
    assert np.max(np.abs(lagged[: step + 1] - sudden[: step + 1])) < 1e-6
    after = round(RATE_HZ / SPENCER_1997.eta_1_s)
    moved = (lagged[step + after] - lagged[step]) / (sudden[step + after] - sudden[step])
    assert 0.4 < moved < 0.8  # 1 - 1/e less what c1 holds back
    # What is left of the delay fades with (c0 + c1) / k0.
    assert np.max(np.abs(lagged[-500:] - sudden[-500:])) < 1.0


def test_the_plain_model_is_the_limit_of_a_stiff_dashpot():
    x, v = motion()
    stiff = SPENCER_1997._replace(c1_a_n_s_m=1e9, c1_b_n_s_m=0.0)
    plain = SPENCER_1997._replace(
        c1_a_n_s_m=math.inf, k0_n_m=0.0, k1_n_m=SPENCER_1997.k0_n_m + SPENCER_1997.k1_n_m,
        x0_m=SPENCER_1997.k1_n_m * SPENCER_1997.x0_m / (SPENCER_1997.k0_n_m + SPENCER_1997.k1_n_m),
    )  # fmt: skip
    forces = [simulate_bouc_wen(p, RATE_HZ, x, v, 1.0) for p in (stiff, plain)]
    assert np.max(np.abs(forces[0] - forces[1])) < 0.5


def test_force_levels_at_the_published_motion_are_those_of_the_prototype():
    # Spencer et al. 1997, Fig. 4: about 900 N at 1.5 V and 16 cm/s; the force grows with each voltage.
    x, v = motion(4, 0.015, 5.0 * math.pi)
    peaks = [np.max(simulate_bouc_wen(SPENCER_1997, RATE_HZ, x, v, u)) for u in (0.0, 0.75, 1.5, LARGEST_V)]
    assert all(np.diff(peaks) > 250.0)
    assert 1000.0 < peaks[2] < 1500.0


def test_it_stands_on_the_dyno_as_any_damper():
    bench = Bench(SPENCER_1997, seed=2)
    campaign = bench.campaign("eq-9.4")
    assert [f for f in check_campaign(campaign) if f.level == "error"] == []
    assert max(run.current_a.max() for run in campaign.runs) == pytest.approx(LARGEST_V)
    fastest = max(np.max(np.abs(run.velocity_m_s)) for run in campaign.runs)
    assert fastest == pytest.approx(0.12 * math.pi, rel=0.01)


def test_a_state_that_runs_away_ends_in_nan_and_the_integration_with_it():
    # Negative gamma and beta give energy: z grows without bounds in finite time.
    x, v = motion(1)
    wild = SPENCER_1997._replace(gamma=-3.63e6, beta=-3.63e6, c1_a_n_s_m=math.inf)
    force = simulate_bouc_wen(wild, RATE_HZ, x, v, 1.5)
    assert math.isfinite(force[0])
    assert math.isnan(force[-1])
