"""Particles that settled before each run are no warmth that it began with, nor the other way round."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from discover.campaigns import picked
from identify.virtual import Bench, random_damper

from mrctl.discover.base_fit import fitted_to
from mrctl.discover.channels.own_recovery import recovers_instead
from mrctl.discover.channels.warm_starts import warm_starts, warmed
from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.grow import grown_by
from mrctl.measurements.run import Campaign
from mrctl.model.damper import EffectSetting
from mrctl.model.effects.registry import effects

RATE_HZ, SECONDS, NOISE_N = 200.0, 6.0, 5.0
BEFORE_S = (0, 6, 2, 10, 4, 0, 8, 1, 15, 3, 0, 5)  # for which each run had gone on before, or stood
LOST, REMIXED_M = 0.4, 1.1  # of the force when all has settled; the way that mixes it again
HEAT = effects()["self_heating"]
HEATED = {"heating_k_j": 3e-2, "cooling_time_s": 20.0, "resistance_ohm": 2.0, "rise_at_start_k": 0.0}


def settled(bench, k, before_s):
    """A run at whose beginning more has settled the longer it stood."""
    t, v = bench.road(RATE_HZ, SECONDS)
    run = bench.run(f"{k}", t, v, (0.5, 2.5)[k % 2], (25.0, 55.0)[k // 2 % 2])
    lost = LOST * (1.0 - np.exp(-before_s / 6.0)) * np.exp(-np.cumsum(np.abs(v)) / RATE_HZ / REMIXED_M)
    return replace(run, force_n=run.force_n * (1.0 - lost))


def heated(bench, k, before_s):
    """A run cut out of a longer one, its fluid as warm as that had made it."""
    t, v = bench.road(RATE_HZ, before_s + SECONDS)
    run = bench.run(f"{k}", t, v, (0.5, 2.5)[k % 2], (25.0, 55.0)[k // 2 % 2])
    return picked(run, slice(round(before_s * RATE_HZ), None))


@pytest.mark.parametrize(
    ("run_of", "warmth"), [(settled, None), (heated, EffectSetting("self_heating", HEATED))]
)
def test_the_runs_say_whether_they_had_stood_or_were_warm(run_of, warmth):
    damper = replace(random_damper(3), effects=() if warmth is None else (warmth,))
    bench = Bench(damper, np.random.default_rng(3), NOISE_N)
    runs = tuple(run_of(bench, k, before_s) for k, before_s in enumerate(BEFORE_S))
    evidence = Evidence.of(Campaign(Path("stood"), runs, "0" * 64))
    base = evidence.base()
    warm = fitted_to(evidence.records, grown_by(base.fit, HEAT))
    theta, by_k, _ = warm_starts(warm, warm.theta)
    assert np.ptp(by_k) > 5.0  # which would serve in both
    begun = replace(warm, solution=replace(warm.solution, theta=theta))
    there = fitted_to(warmed(evidence.records, by_k), begun)
    assert recovers_instead(base.fit, there) is (warmth is None)
