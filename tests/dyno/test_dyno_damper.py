from __future__ import annotations

import numpy as np
import pytest

from mrctl.plant.dyno import damper as damper_module
from mrctl.plant.dyno import motion
from mrctl.plant.dyno.damper import backbone_n, simulate
from mrctl.plant.dyno.parameters import MAGNERIDE_LIKE

RATE_HZ = 2000.0


def run(
    current_a=1.0, amplitude_m=0.0254, frequency_hz=2.387, temperature_c=40.0, cycles=4, damper=MAGNERIDE_LIKE
):
    moving = motion.sine(frequency_hz, amplitude_m, cycles, RATE_HZ)
    current = np.broadcast_to(np.asarray(current_a, dtype=float), len(moving))
    states = simulate(
        damper, RATE_HZ, moving.displacement_m, moving.velocity_m_s, current, temperature_c, temperature_c
    )
    return moving, states


def loop_work_j(moving, states):
    return float(np.trapezoid(states.force_n, moving.displacement_m))


def test_the_damper_takes_energy_and_gives_none():
    for i in (0.0, 0.3, 3.0):
        assert loop_work_j(*run(i)) > 10.0


@pytest.mark.parametrize("current_a", [0.0, 3.0])
def test_finer_integration_does_not_change_the_force(monkeypatch, current_a):
    coarse = run(current_a)[1].force_n
    monkeypatch.setattr(damper_module, "SUBSTEPS", 4 * damper_module.SUBSTEPS)
    assert np.max(np.abs(run(current_a)[1].force_n - coarse)) < 0.1


def test_very_slow_change_of_velocity_comes_to_the_backbone():
    stiff = MAGNERIDE_LIKE._replace(
        gas_stiffness_n_m=0.0, settled=1.0, stiffness_n_m=1e8, relaxation_s=1e-4, relaxation_off_s=0.0,
        fluid_heat_j_k=1e12,
    )  # fmt: skip
    moving, states = run(2.0, 0.05, 0.05, damper=stiff, cycles=2)
    expected = backbone_n(stiff, moving.velocity_m_s, 2.0, 40.0)
    assert np.max(np.abs(states.force_n - expected)) < 2.0


def test_force_grows_with_current_and_falls_with_heat():
    peaks = [np.max(run(i)[1].force_n) for i in (0.0, 0.05, 0.2, 1.0, 2.0, 3.0)]
    assert all(np.diff(peaks) > 0)
    for i in (0.0, 1.0, 3.0):
        assert np.max(run(i, temperature_c=80.0)[1].force_n) < np.max(run(i, temperature_c=30.0)[1].force_n)


def test_the_loop_is_wider_for_more_current_and_for_less_amplitude():
    def width(i, amplitude_m):
        moving, states = run(i, amplitude_m, 2.387 * 0.0254 / amplitude_m, cycles=6)
        half = slice(len(moving) // 2, None)
        v, f = moving.velocity_m_s[half], states.force_n[half]
        near_zero = np.abs(v) < 0.01
        return np.std(f[near_zero]) / np.max(f)

    assert width(3.0, 0.0254) < width(3.0, 0.01)
    moving, states = run(3.0)
    crossing = np.flatnonzero(np.diff(np.sign(moving.velocity_m_s)) != 0)[3:-3]
    strong = np.abs(states.force_n[crossing]).mean()
    weak = np.abs(run(0.0)[1].force_n[crossing]).mean()
    assert strong > 2.0 * weak


def test_current_steps_arrive_late_and_leave_sooner():
    moving = motion.sine(1.0, 0.05, 4, RATE_HZ)
    current = np.zeros(len(moving))
    current[2000:4000] = 2.0
    states = simulate(
        MAGNERIDE_LIKE, RATE_HZ, moving.displacement_m, moving.velocity_m_s, current, 40.0, 40.0
    )
    rise = np.argmax(states.field_current_a[2000:4000] > 2.0 * 0.632) / RATE_HZ
    fall = np.argmax(states.field_current_a[4000:] < 2.0 * 0.368) / RATE_HZ
    assert rise == pytest.approx(MAGNERIDE_LIKE.coil_rise_s, abs=1e-3)
    assert fall == pytest.approx(MAGNERIDE_LIKE.coil_fall_s, abs=1e-3)


def test_work_becomes_heat_in_fluid_and_case():
    moving, states = run(2.0)
    p = MAGNERIDE_LIKE
    assert states.fluid_temperature_c[-1] > states.case_temperature_c[-1] > 40.0
    stored = p.fluid_heat_j_k * (states.fluid_temperature_c[-1] - 40.0) + p.case_heat_j_k * (
        states.case_temperature_c[-1] - 40.0
    )
    seconds = len(moving) / RATE_HZ
    given = loop_work_j(moving, states) + p.coil_resistance_ohm * 4.0 * seconds
    assert stored == pytest.approx(given, rel=0.06)  # seals, gas and air take the rest


def test_it_stays_finite_far_from_where_it_was_set_up():
    for temperature in (-60.0, 250.0):
        force = run(3.0, temperature_c=temperature)[1].force_n
        assert np.all(np.isfinite(force))
        assert np.max(np.abs(force)) < 2e4
