"""A filter may be late by itself, as the published one is: that is no effect, and no error is left by it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from discover.campaigns import road, shipped, with_effect

from mrctl.discover.diagnose import diagnose
from mrctl.discover.extend import extend
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper
from mrctl.model.effects.registry import effects

NOISE_N = 4.0


def _campaign(damper: Damper) -> Campaign:
    def noise(rng: np.random.Generator, n: int) -> np.ndarray:
        return rng.normal(0.0, NOISE_N, n)

    runs = [road(damper, seconds=8.0, seed=seed, noise=noise, name=f"road_{seed}.csv") for seed in range(4)]
    return Campaign(Path("roads"), tuple(runs), "0" * 64)


def test_the_published_filter_alone_is_no_delay():
    result = diagnose(_campaign(shipped()))
    assert (result.verdict, result.effects) == ("none", ())
    assert "taken as its own" in result.hidden["sensor_delay"]
    assert result.final.mean_square < 1.1 * NOISE_N**2


def test_beside_it_an_effect_is_named_alone_and_leaves_the_noise():
    damper = with_effect(shipped(), "quadratic_damping", coefficient_n_s2_m2=400.0, lag_s=0.0)
    campaign = _campaign(damper)
    result = diagnose(campaign)
    assert (result.verdict, result.effects) == ("found", ("quadratic_damping",))
    extension = extend(campaign, (), (effects()["quadratic_damping"],))
    assert extension.rmse_after_n < 1.05 * NOISE_N < extension.rmse_before_n


def test_a_late_force_is_still_a_delay():
    result = diagnose(_campaign(with_effect(shipped(), "sensor_delay", delay_s=3e-3)))
    assert (result.verdict, result.effects) == ("found", ("sensor_delay",))
    assert result.final.fit.effect_values["sensor_delay"][0] == pytest.approx(3.5e-3, abs=0.5e-3)
