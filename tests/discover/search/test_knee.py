"""A spring in series with what yields, solved together with the fluid behind it: seen, and with its size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from mrctl.discover.evidence import Evidence
from mrctl.discover.search.levels import search_level
from mrctl.measurements.run import Campaign, Run
from mrctl.model.effects.registry import effect

RATE_HZ, NOISE_N = 2000.0, 4.0
SPRING_N_M, KNEE_M_S, FLOW_S_M = 1.5e6, 0.05, 1.0
CORNER_HZ = 60.0


def _force(level_n, amplitude_m, frequency_hz, t):
    """f h (z + flow v) behind a lag, z = what the spring holds: dz/dt = K (v - knee atanh(z)) / (f h)."""
    w = 2.0 * np.pi * frequency_hz

    def velocity(u):
        return amplitude_m * w * (np.cos(w * u) + 0.4 * np.cos(2.6 * w * u))

    def maxwell(u, z):
        flow = KNEE_M_S * np.arctanh(np.clip(z, -0.999999, 0.999999))
        return SPRING_N_M * (velocity(u) - flow) / level_n

    begin = [np.tanh(velocity(0.0) / KNEE_M_S)]
    z = solve_ivp(maxwell, (t[0], t[-1]), begin, "LSODA", t_eval=t, rtol=1e-7, atol=1e-9, max_step=2e-3).y[0]
    force = level_n * (z + FLOW_S_M * velocity(t))
    keep = np.exp(-2.0 * np.pi * CORNER_HZ / RATE_HZ)
    return velocity(t), lfilter([1.0 - keep], [1.0, -keep], force, zi=[keep * force[0]])[0]


def _campaign() -> Campaign:
    random, runs = np.random.default_rng(11), []
    t = np.arange(int(3.0 * RATE_HZ)) / RATE_HZ
    for k, (current_a, amplitude_m, frequency_hz) in enumerate(
        [
            (0.2, 0.02, 1.0),
            (0.2, 0.006, 5.0),
            (1.0, 0.02, 1.0),
            (1.0, 0.01, 3.0),
            (2.0, 0.02, 1.5),
            (2.0, 0.004, 7.0),
        ]
    ):
        v, force_n = _force(300.0 + 800.0 * current_a, amplitude_m, frequency_hz, t)
        x = np.cumsum(v) / RATE_HZ
        steady = np.full(t.size, current_a), np.full(t.size, 35.0)
        measured = force_n + random.normal(0.0, NOISE_N, t.size)
        signals = measured, x - x.mean(), np.gradient(v, 1.0 / RATE_HZ)
        runs.append(Run(f"{k}", Path(f"{k}.csv"), t, v, *steady, *signals, RATE_HZ))
    return Campaign(Path("maxwell"), tuple(runs), "0" * 64)


@pytest.mark.long
def test_a_spring_before_what_yields_is_told_from_one_behind_the_rod():
    evidence = Evidence.of(_campaign())
    candidates = evidence.sized([effect("preyield_stiffness"), effect("mount_compliance")])
    level = search_level(evidence.base(), candidates, evidence.folds)
    best, other = level.trials
    assert best.effect.name == "preyield_stiffness"
    assert best.proof.mean_square < 0.5 * NOISE_N**2 < 0.3 * other.proof.mean_square
    values = dict(
        zip([p.name for p in best.effect.parameters], best.fit.effect_values[best.effect.name], strict=True)
    )
    assert values["knee"] > 0.5
    assert values["creep"] > 0.9
    length_m = values["yield_length_m"] + values["compliance_m_n"] * 1500.0
    assert length_m == pytest.approx(1500.0 / SPRING_N_M, rel=0.2)
