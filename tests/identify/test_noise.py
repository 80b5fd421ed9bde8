"""How many samples of a residual are witnesses: noise all of them, what comes again in each cycle once."""

from __future__ import annotations

import numpy as np
import pytest
from discover.hidden import NOISE_N, one_frequency

from mrctl.discover.fits.refit import fitted
from mrctl.identify import run_scatter
from mrctl.identify.noise import repeated
from mrctl.identify.records import records_of
from mrctl.model.effects.registry import effect

SPRING = {"preload_n": 0.0, "stiffness_n_m": 4000.0, "progression_per_m": 0.0}
RATE_HZ, CYCLES = 400.0, 20
T = np.arange(int(CYCLES / 2.0 * RATE_HZ)) / RATE_HZ
RANDOM = np.random.default_rng(3)
SINE = np.sin(4.0 * np.pi * T) + 0.005 * RANDOM.normal(size=T.size)
NOISE = RANDOM.normal(size=T.size)
AGAIN = np.sin(12.0 * np.pi * T) + np.cos(20.0 * np.pi * T)  # 1 N² of it


@pytest.mark.parametrize(
    ("motion", "residual", "times"),
    [
        (SINE, NOISE, 1.0),
        (SINE, AGAIN, CYCLES),
        (SINE, AGAIN + NOISE, 1.0 + 0.5 * (CYCLES - 1)),
        (np.cumsum(NOISE), AGAIN, 1.0),  # that motion does not repeat
        (0.0 * T, AGAIN, 1.0),
        (SINE[:10], AGAIN[:10], 1.0),
    ],
)
def test_what_comes_again_in_each_cycle_is_said_as_often(motion, residual, times):
    assert repeated(motion, residual) == pytest.approx(times, rel=0.15)


def test_what_no_model_follows_does_not_bend_a_table(monkeypatch):
    """A wave of the force against the motion, in each cycle the same: more cycles say no more of g."""
    runs = one_frequency({"gas_spring": SPRING}).runs
    for run in runs:
        turns = np.unwrap(np.arctan2(run.displacement_m / 0.02, run.velocity_m_s / 0.25))
        run.force_n[:] += 8.0 * NOISE_N * np.sin(23.0 * turns)
    records = records_of(runs)

    def roughness():
        fit = fitted(records, [effect("gas_spring")], {"gas_spring": effect("gas_spring").vector(SPRING)})
        return float(np.abs(np.diff(fit.tables.g, n=2)).sum())

    once = roughness()
    monkeypatch.setattr(run_scatter, "repeated", lambda *_: 1.0)
    assert once < 0.7 * roughness()
