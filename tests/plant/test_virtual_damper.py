"""The virtual damper: the forward model, with a coil that lags and warmth from its work."""

from __future__ import annotations

import dataclasses
import math

import pytest
from model.dampers import magneride

from mrctl.model.forward import ForwardModel
from mrctl.model.static import backbone_force
from mrctl.plant.virtual_damper import Extremes, PhysicsParameters, VirtualDamper, beyond_tables

DAMPER = magneride()
DT = 0.0005
IDEAL = PhysicsParameters(coil_rise_s=0.0, coil_fall_s=0.0, heat_capacity_j_k=1e12)


def sine(k, frequency_hz=2.0, amplitude=0.3):
    return amplitude * math.sin(2.0 * math.pi * frequency_hz * k * DT)


def test_without_lag_and_warming_it_is_the_forward_model():
    damper, model = VirtualDamper(DAMPER, DT, 60.0, IDEAL), ForwardModel(DAMPER, DT)
    for k in range(2000):
        current = 1.0 + math.sin(0.01 * k)
        assert damper.step(sine(k), current) == pytest.approx(model.step(sine(k), current, 60.0), abs=1e-6)


def test_coil_follows_with_its_time_constants_up_and_down():
    damper = VirtualDamper(DAMPER, DT, 25.0, PhysicsParameters(coil_rise_s=0.01, coil_fall_s=0.02))
    for _ in range(20):
        damper.step(0.0, 2.0)
    assert damper.current_a == pytest.approx(2.0 * (1.0 - math.exp(-1.0)))
    peak = damper.current_a
    for _ in range(40):
        damper.step(0.0, 0.0)
    assert damper.current_a == pytest.approx(peak * math.exp(-1.0))


def test_damper_dissipates():
    damper = VirtualDamper(DAMPER, DT, 25.0)
    work = [damper.step(sine(k), 1.0) * sine(k) * DT for k in range(4000)]
    assert sum(work) > 0.0
    # Hysteresis gives a little back near the turning points, no more.
    assert -sum(w for w in work if w < 0.0) < 0.05 * sum(work)


def test_heat_balance_is_closed():
    physics = PhysicsParameters(heat_capacity_j_k=500.0, cooling_w_k=5.0, coil_resistance_ohm=2.0)
    damper = VirtualDamper(DAMPER, DT, 40.0, physics, ambient_c=20.0)
    heat = 0.0
    for k in range(40_000):
        before = damper.temperature_c
        force = damper.step(sine(k), 1.5)
        heat += DT * (force * sine(k) + 2.0 * damper.current_a**2 - 5.0 * (before - 20.0))
    assert damper.temperature_c > 45.0
    assert damper.temperature_c - 40.0 == pytest.approx(heat / 500.0, rel=1e-9)


def test_idle_damper_cools_to_its_surroundings():
    physics = PhysicsParameters(heat_capacity_j_k=10.0, cooling_w_k=10.0)
    damper = VirtualDamper(DAMPER, DT, 80.0, physics, ambient_c=30.0)
    for _ in range(20_000):
        damper.step(0.0, 0.0)
    assert damper.temperature_c == pytest.approx(30.0, abs=0.01)


def test_within_the_tables_nothing_changes_and_beyond_h_goes_on_along_its_line():
    static, true = DAMPER.static, beyond_tables(DAMPER.static)
    for T in (28.9, 40.0, 55.0, 66.1, 82.8):
        assert backbone_force(0.2, 2.0, T, true) == pytest.approx(backbone_force(0.2, 2.0, T, static))
    at_end, beyond, further = (backbone_force(0.2, 2.0, T, true) for T in (82.8, 92.8, 102.8))
    inside = backbone_force(0.2, 2.0, 72.8, true)
    assert at_end - beyond == pytest.approx(inside - at_end)
    assert beyond - further == pytest.approx(at_end - beyond)
    assert backbone_force(0.2, 2.0, 0.0, true) > backbone_force(0.2, 2.0, 28.9, true)


def test_h_never_falls_below_its_floor():
    true = beyond_tables(DAMPER.static)
    assert min(true.h_off) == pytest.approx(0.05)
    assert all(low < high for low, high in zip(true.temperature_c, true.temperature_c[1:], strict=False))


def test_velocity_beyond_the_table_holds():
    true = beyond_tables(DAMPER.static)
    assert backbone_force(5.0, 1.0, 30.0, true) == backbone_force(0.381, 1.0, 30.0, true)


def test_extremes_bracket_every_current():
    extremes, damper = Extremes(DAMPER, DT), VirtualDamper(DAMPER, DT, 60.0, IDEAL)
    for k in range(4000):
        extremes.step(sine(k), 60.0)
        force = damper.step(sine(k), 1.3)
        low, high = sorted((extremes.soft_n, extremes.firm_n))
        assert low - 1e-6 <= force <= high + 1e-6


def test_single_temperature_table_stays_as_it_is():
    one = dataclasses.replace(DAMPER).static._replace(temperature_c=(25.0,), h_off=(1.0,), h_on=(1.0,))
    assert beyond_tables(one) is one


@pytest.mark.parametrize(
    "wrong", [{"coil_rise_s": -0.1}, {"heat_capacity_j_k": 0.0}, {"cooling_w_k": math.inf}]
)
def test_impossible_physics_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        PhysicsParameters(**wrong)
