"""Noise is another in each run: what runs of one motion leave alike has come from the motion."""

from __future__ import annotations

import numpy as np
import pytest
from discover.hidden import among, few, rich

from mrctl.discover.diagnose import diagnose
from mrctl.discover.noise.shared_motion import shared_n2
from mrctl.discover.reports.figures import diagnosis_figures

SIZE = 3000
MOTIONS = [np.sin(np.arange(SIZE) / 40.0), np.sin(np.arange(SIZE) / 90.0)]
VELOCITIES = [MOTIONS[k % 2] for k in range(8)]


def _noise(random: np.random.Generator) -> np.ndarray:
    return np.convolve(random.normal(0.0, 5.0, SIZE), [1.0, 0.8, 0.5, 0.2], mode="same")


def _left(share_n: float, seed: int = 4) -> list[np.ndarray]:
    """Noise of each run, and a wave of that RMS whose course each motion has another of."""
    random = np.random.default_rng(seed)
    waves = [np.sqrt(2.0) * share_n * np.sin(np.cumsum(random.normal(0.1, 0.1, SIZE))) for _ in MOTIONS]
    return [_noise(random) + waves[k % 2] for k in range(8)]


@pytest.mark.parametrize("seed", range(20))
def test_noise_is_not_alike(seed):
    assert shared_n2(_left(0.0, seed), VELOCITIES) == 0.0


def test_what_has_come_from_the_motion_is():
    """As far as it is certain: products of so coloured noise scatter."""
    assert 8.0 < shared_n2(_left(5.0), VELOCITIES) <= 25.0
    later = [e[37 * (k % 3) :] for k, e in enumerate(_left(5.0))]
    cut = [v[37 * (k % 3) :] for k, v in enumerate(VELOCITIES)]
    assert 8.0 < shared_n2(later, cut) <= 25.0


def test_noise_that_is_one_in_all_runs_has_not_come_from_the_motion():
    errors = [_noise(np.random.default_rng(1)) for _ in range(8)]
    assert shared_n2(errors, VELOCITIES) == 0.0


def test_where_no_motion_was_run_twice_nothing_is_known():
    assert shared_n2(_left(5.0)[:2], VELOCITIES[:2]) == 0.0


@pytest.mark.long
def test_a_force_of_the_way_gone_is_not_taken_for_noise(monkeypatch):
    """It does not repeat from cycle to cycle and no signal tells it, but in runs of one motion it is one."""
    among(monkeypatch, "end_stop", "coulomb_friction", "gas_spring", "stroke_dependent_damping")
    campaign = few(rich())
    for run in campaign.runs:
        side = np.sign(run.displacement_m) * np.sign(np.gradient(np.abs(run.displacement_m)))
        run.force_n[:] += 70.0 * np.sin(120.0 * np.cumsum(np.abs(run.velocity_m_s)) * run.dt_s) * side
    result = diagnose(campaign)
    assert (result.verdict, result.effects) == ("unexplained", ())
    assert "alike in runs of one motion" in diagnosis_figures(result)["words"]
