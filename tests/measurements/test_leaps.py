"""Of an accelerometer that leaps for single samples, the velocity's slope drives a model in its place."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrctl.identify.records import records_of
from mrctl.measurements.leaps import as_it_moved
from mrctl.measurements.run import Run

RATE_HZ = 500.0
T_S = np.arange(2000) / RATE_HZ
W = 2.0 * np.pi * 1.5
V, SLOPE = 0.3 * np.sin(W * T_S), 0.3 * W * np.cos(W * T_S)
STRUCK = np.where(np.isin(np.arange(T_S.size), (650, 1300)), 700.0, SLOPE)
MASS_KG = 3.0


def run_of(acceleration, derived=()):
    still = np.full(T_S.size, 0.5), np.full(T_S.size, 30.0)
    force = 900.0 * np.tanh(V / 0.05) + MASS_KG * SLOPE
    x = -0.3 / W * np.cos(W * T_S)
    return Run("run", Path("run.csv"), T_S, V, *still, force, x, acceleration, RATE_HZ, derived=derived)


def test_the_velocitys_slope_stands_in_for_it_and_in_a_fit_as_well():
    moved = as_it_moved(run_of(STRUCK))
    assert moved.acceleration_m_s2 == pytest.approx(SLOPE, abs=0.02)
    (record,) = records_of([run_of(STRUCK)])
    assert record.acceleration_m_s2 == pytest.approx(SLOPE, abs=0.02)


def test_one_that_does_not_leap_is_kept_to_the_bit():
    steps = np.where(T_S > 2.0, 20.0, 0.0)  # a step of the motion is no leap
    for kept in (SLOPE, SLOPE + steps):
        assert as_it_moved(run_of(kept)).acceleration_m_s2 is kept


def test_a_velocity_that_was_made_of_it_is_no_second_witness():
    run = run_of(STRUCK, ("velocity_m_s", "displacement_m"))
    assert as_it_moved(run).acceleration_m_s2 is STRUCK
    told = replace(run, derived=("velocity_m_s",))  # of the stroke, which was measured
    assert as_it_moved(told).acceleration_m_s2 == pytest.approx(SLOPE, abs=0.02)
