"""The quarter car obeys mechanics: equilibrium, frequencies, energy, a tyre that lifts off."""

from __future__ import annotations

import numpy as np
import pytest

from mrctl.plant.quarter_car import QuarterCar, QuarterCarParameters
from mrctl.plant.road import Bump, Flat

DT = 0.0005
UNDAMPED = QuarterCarParameters(tyre_damping_n_s_m=0.0)


def test_car_stays_at_rest_on_a_flat_road():
    car = QuarterCar(Flat(), 20.0)
    for _ in range(1000):
        car.step(DT, 0.0)
    assert car.body_m == car.wheel_m == 0.0
    assert car.tyre_force_n == car.static_tyre_force_n == pytest.approx(440.0 * 9.81)


def test_force_that_resists_extension_pulls_the_body_down_and_the_wheel_up():
    car = QuarterCar(Flat(), 0.0)
    car.step(DT, 100.0)
    assert car.body_velocity_m_s == pytest.approx(-100.0 / 400.0 * DT, rel=1e-3)
    assert car.wheel_velocity_m_s == pytest.approx(100.0 / 40.0 * DT, rel=1e-3)
    assert car.body_acceleration_m_s2 < 0.0
    assert car.relative_velocity_m_s < 0.0


def test_frequencies_of_the_undamped_car_are_those_of_its_matrices():
    p = UNDAMPED
    stiffness = np.array([[p.spring_n_m, -p.spring_n_m], [-p.spring_n_m, p.spring_n_m + p.tyre_n_m]])
    eigenvalues = np.linalg.eigvals(np.diag([1.0 / p.body_mass_kg, 1.0 / p.wheel_mass_kg]) @ stiffness)
    wanted = np.sort(np.sqrt(eigenvalues)) / (2.0 * np.pi)
    car = QuarterCar(Flat(), 0.0, p)
    car.body_velocity_m_s, car.wheel_velocity_m_s = 0.1, 0.4
    body = []
    for _ in range(40_000):
        car.step(DT, 0.0)
        body.append(car.body_acceleration_m_s2)
    spectrum = np.abs(np.fft.rfft(np.array(body) * np.hanning(len(body))))
    f = np.fft.rfftfreq(len(body), DT)
    low, high = f < 5.0, f >= 5.0
    found = f[low][np.argmax(spectrum[low])], f[high][np.argmax(spectrum[high])]
    assert found == pytest.approx(wanted, abs=0.05)


def test_undamped_car_keeps_its_energy():
    car = QuarterCar(Flat(), 0.0, UNDAMPED)
    car.body_velocity_m_s = 0.2
    start = car.energy_j()
    for _ in range(20_000):
        car.step(DT, 0.0)
    assert car.energy_j() == pytest.approx(start, rel=1e-4)


def test_energy_lost_is_the_work_of_the_damper():
    car = QuarterCar(Flat(), 0.0, UNDAMPED)
    car.body_velocity_m_s = 0.3
    start, work = car.energy_j(), 0.0
    for _ in range(2000):
        force = 1500.0 * car.relative_velocity_m_s
        before = car.displacement_m
        car.step(DT, force)
        work += force * (car.displacement_m - before)
    assert work > 0.5 * start
    assert car.energy_j() == pytest.approx(start - work, abs=0.002 * start)


def test_tyre_pushes_only_and_leaves_the_ground_over_a_cliff_of_a_bump():
    car = QuarterCar(Bump(1.0, 0.6, 0.12), 15.0)
    forces = []
    for _ in range(2000):
        car.step(DT, 1500.0 * car.relative_velocity_m_s)
        forces.append(car.tyre_force_n)
    assert min(forces) == 0.0
    assert max(forces) > 2.0 * car.static_tyre_force_n


def test_car_starts_at_the_height_of_the_road():
    car = QuarterCar(Bump(0.0, 2.0, 0.1), 0.0, start_m=1.0)
    car.step(DT, 0.0)
    assert car.body_m == pytest.approx(0.1)
    assert car.tyre_force_n == pytest.approx(car.static_tyre_force_n)


def test_half_the_step_gives_the_same_ride():
    rides = []
    for dt in (DT, DT / 2.0):
        car = QuarterCar(Bump(1.0, 4.0, 0.05), 20.0)
        for _ in range(round(1.0 / dt)):
            car.step(dt, 0.0)
        rides.append((car.body_m, car.wheel_m, car.body_velocity_m_s))
    assert rides[0] == pytest.approx(rides[1], abs=2e-5)


@pytest.mark.parametrize("wrong", [{"body_mass_kg": 0.0}, {"spring_n_m": float("nan")}, {"tyre_n_m": -1.0}])
def test_impossible_car_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        QuarterCarParameters(**wrong)
