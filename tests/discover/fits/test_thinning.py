"""No damper's force grows as it warms: what recovers in the course of a run is no warmth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from identify.virtual import Bench, random_damper

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.thinning import thins_as_it_warms
from mrctl.discover.search.levels import search_level
from mrctl.measurements.run import Campaign
from mrctl.model.effects.registry import effects

RATE_HZ, SECONDS, NOISE_N = 200.0, 10.0, 5.0
SETTLED = (1.0, 0.05, 0.3, 0.05, 0.8, 0.05, 0.05, 0.6, 0.05, 1.0, 0.1, 0.05)  # by the rest before each run
LOST, REMIXED_M = 0.4, 0.9  # of the force when all has settled; the path that mixes it again
HEAT = effects()["self_heating"]


@pytest.fixture(scope="module")
def evidence():
    """Roads at the beginning of which particles have settled."""
    bench = Bench(random_damper(3), np.random.default_rng(3), NOISE_N)
    runs = []
    for k, settled in enumerate(SETTLED):
        t, v = bench.road(RATE_HZ, SECONDS)
        run = bench.run(f"{k}", t, v, (0.5, 2.5)[k % 2], (22.0, 24.0)[k // 2 % 2])
        path_m = np.cumsum(np.abs(run.velocity_m_s)) / RATE_HZ
        lost = LOST * settled * np.exp(-path_m / REMIXED_M)
        runs.append(replace(run, force_n=run.force_n * (1.0 - lost)))
    return Evidence.of(Campaign(Path("settled"), tuple(runs), "0" * 64))


@pytest.mark.long
def test_particles_that_are_mixed_again_are_no_warmth(evidence):
    """One would fit them better, with an h that grows."""
    assert not search_level(evidence.base(), [HEAT], evidence.folds).trials


@pytest.mark.parametrize(("per_k", "thins"), [(-0.04, True), (0.0, True), (0.04, False)])
def test_a_force_that_grows_with_warmth_is_no_fluids(evidence, per_k, thins):
    fit = evidence.base([HEAT], {HEAT.name: HEAT.typical}).fit
    layout, theta = fit.model.layout, fit.theta.copy()
    rise_k = layout.temperature_c[layout.free_h] - layout.temperature_c[layout.reference]
    for name in ("h_on", "h_off"):
        h = theta[layout.parts[name]]
        h[:] = per_k * rise_k[: h.size]
    assert thins_as_it_warms(replace(fit, solution=replace(fit.solution, theta=theta))) is thins


def test_a_model_in_which_nothing_warms_up_is_not_asked(evidence):
    assert thins_as_it_warms(evidence.base().fit)
