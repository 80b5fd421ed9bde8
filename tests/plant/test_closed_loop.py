"""Corner and controller in lock step, and the figures made of it."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from model.dampers import magneride

from mrctl.control.laws import make_law
from mrctl.control.maps import make_current_map
from mrctl.plant.closed_loop import Record, constant_current, controller, measured_corner, metrics, simulate
from mrctl.plant.corner import STEP_S, Corner
from mrctl.plant.quarter_car import QuarterCar
from mrctl.plant.road import Bump, Flat, IsoRoad, Sum
from mrctl.plant.virtual_damper import PhysicsParameters, VirtualDamper

DAMPER = magneride()
SKYHOOK = make_law("skyhook_continuous")


def rough_corner(temperature_c=25.0, physics=None):
    road = Sum(IsoRoad("C", 1), Bump(60.0, 4.0, 0.05))
    return measured_corner(QuarterCar(road, 20.0), DAMPER, temperature_c, physics)


def ride(control, temperature_c=25.0, duration_s=5.0, physics=None):
    return metrics(simulate(rough_corner(temperature_c, physics), control, duration_s))


def test_free_decay_loses_energy_until_rest():
    car = QuarterCar(Flat(), 0.0)
    corner = Corner(car, VirtualDamper(DAMPER, STEP_S, 25.0))
    car.body_velocity_m_s = 0.5
    energy = [car.energy_j()]
    for _ in range(30):
        corner.step(0.1, 0.5)
        energy.append(car.energy_j())
    assert all(after < before + 1e-6 for before, after in itertools.pairwise(energy))
    assert energy[-1] < 1e-3 * energy[0]


@pytest.mark.parametrize("current_a", [0.0, 1.5, 3.0])
def test_corner_at_rest_stays_at_rest_and_small_motion_dies_out_at_every_current(current_a):
    car = QuarterCar(Flat(), 0.0)
    corner = Corner(car, VirtualDamper(DAMPER, STEP_S, 20.0))
    corner.step(0.5, current_a)
    assert car.energy_j() == 0.0
    car.wheel_velocity_m_s = 0.01
    corner.step(2.0, current_a)
    assert abs(car.relative_velocity_m_s) < 1e-4


def test_record_is_whole_and_forces_belong_to_their_tick():
    record = simulate(rough_corner(), constant_current(SKYHOOK, 0.0), 1.0)
    assert all(getattr(record, f.name).shape == (1000,) for f in dataclasses.fields(record))
    assert record.time_s[-1] == pytest.approx(0.999)
    assert record.force_n == pytest.approx(record.force_soft_n, abs=1e-9)
    assert record.after(0.5).time_s[0] == pytest.approx(0.5)


def test_constant_full_current_is_the_firm_extreme():
    corner = rough_corner(physics=PhysicsParameters(coil_rise_s=0.0, coil_fall_s=0.0))
    record = simulate(corner, constant_current(SKYHOOK, 3.0), 1.0)
    assert record.force_n == pytest.approx(record.force_firm_n, abs=1e-9)


def test_skyhook_with_the_inverse_rides_better_than_passive():
    soft, firm = (ride(constant_current(SKYHOOK, i)) for i in (0.0, 1.5))
    sky = ride(controller(SKYHOOK, make_current_map("inverse", DAMPER, 0.001)))
    assert sky.body_acceleration_rms_m_s2 < soft.body_acceleration_rms_m_s2
    assert sky.body_acceleration_rms_m_s2 < firm.body_acceleration_rms_m_s2
    assert sky.tyre_load_variation_rms_n < soft.tyre_load_variation_rms_n


def test_inverse_tracks_better_than_every_baseline_at_every_temperature():
    for temperature in (25.0, 85.0):
        error = {
            name: ride(controller(SKYHOOK, make_current_map(name, DAMPER, 0.001)), temperature).tracking_rms_n
            for name in ("linear", "reader", "liu", "inverse")
        }
        assert min(error, key=error.__getitem__) == "inverse"
        assert error["inverse"] < 0.65 * error["linear"]


def test_without_coil_lag_the_inverse_tracks_with_a_third_of_the_linear_maps_error_when_hot():
    quick = PhysicsParameters(coil_rise_s=0.0, coil_fall_s=0.0)
    linear, inverse = (
        ride(controller(SKYHOOK, make_current_map(name, DAMPER, 0.001)), 85.0, physics=quick).tracking_rms_n
        for name in ("linear", "inverse")
    )
    assert inverse < linear / 3.0


def record_of(force, wish, soft, firm, tyre):
    zero = np.zeros(len(force))
    columns = dict.fromkeys((f.name for f in dataclasses.fields(Record)), zero)
    columns.update(
        force_n=np.array(force),
        force_wish_n=np.array(wish),
        force_soft_n=np.array(soft),
        force_firm_n=np.array(firm),
        tyre_force_n=np.array(tyre),
        body_acceleration_m_s2=np.array([1.0, -1.0]),
    )
    return Record(**columns)


def test_metrics_compare_with_the_reachable_part_of_the_wish():
    m = metrics(record_of([100.0, -100.0], [500.0, 0.0], [50.0, -90.0], [103.0, -800.0], [4000.0, 4200.0]))
    assert m.peak_force_n == 100.0
    assert m.tracking_rms_n == pytest.approx(np.sqrt((3.0**2 + 10.0**2) / 2.0))
    assert m.tracking_percent == pytest.approx(m.tracking_rms_n)
    assert m.raw_tracking_rms_n == pytest.approx(np.sqrt((400.0**2 + 100.0**2) / 2.0))
    assert m.body_acceleration_rms_m_s2 == 1.0
    assert m.tyre_load_variation_rms_n == 100.0


def test_corner_refuses_a_broken_step_and_a_run_without_extremes():
    corner = Corner(QuarterCar(Flat(), 0.0), VirtualDamper(DAMPER, STEP_S, 25.0))
    with pytest.raises(ValueError, match="choose a multiple"):
        corner.step(0.0007, 0.0)
    with pytest.raises(ValueError, match="use measured_corner"):
        simulate(corner, constant_current(SKYHOOK, 0.0), 0.1)
