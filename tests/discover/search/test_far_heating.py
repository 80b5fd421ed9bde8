"""A fluid that warms itself at three temperatures of the case: the base bends its h to and fro for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.grow import grown
from mrctl.discover.fits.screen import Screen
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.far_looks import far_look, far_points, promises, winds
from mrctl.measurements.run import Campaign, Run
from mrctl.model.effects.registry import effect

RATE_HZ, SECONDS, NOISE_N = 100.0, 40.0, 2.0
CAPACITY_J_K, TRANSFER_W_K, RESISTANCE_OHM, CASE_SHARE = 250.0, 3.0, 3.0, 0.1
RUNS = [
    (0.0, 20.0, 0.6),
    (1.5, 20.0, 0.1),
    (0.7, 45.0, 0.25),
    (1.5, 45.0, 0.15),
    (0.7, 70.0, 0.2),
    (0.2, 70.0, 0.3),
]


def _campaign(warming: float) -> Campaign:
    random, runs = np.random.default_rng(6), []
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    for k, (current_a, case_c, top_m_s) in enumerate(RUNS):
        w = 2.0 * np.pi * (1.0 + 0.3 * k)
        swell = 0.6 + 0.4 * np.sin(0.5 * t)
        x = top_m_s / w * swell * np.sin(w * t)
        v = np.gradient(x, 1.0 / RATE_HZ)
        cold_n = (120.0 + 700.0 * np.tanh(current_a)) * (np.tanh(v / 0.03) + 0.8 * v)
        fluid_c, temperature_c, force_n = case_c, np.empty(t.size), np.empty(t.size)
        for n in range(t.size):
            force_n[n] = cold_n[n] * np.exp(-0.012 * (fluid_c - 20.0))
            temperature_c[n] = case_c + CASE_SHARE * (fluid_c - case_c)
            power_w = abs(force_n[n] * v[n]) + RESISTANCE_OHM * current_a**2
            lost_w = TRANSFER_W_K * (fluid_c - temperature_c[n])
            fluid_c += warming * (power_w - lost_w) / CAPACITY_J_K / RATE_HZ
        force_n += random.normal(0.0, NOISE_N, t.size)
        columns = np.full(t.size, current_a), temperature_c, force_n, x, np.gradient(v, 1.0 / RATE_HZ)
        runs.append(Run(f"{k}", Path(f"{k}.csv"), t, v, *columns, RATE_HZ))
    return Campaign(Path("warm"), tuple(runs), "0" * 64)


def _looks(warming: float):
    tangent = Tangent.of(Evidence.of(_campaign(warming)).base().fit)
    screen = Screen(tangent)
    points = far_points(screen, [effect("self_heating")])
    return tangent, [far_look(screen, promises(screen, *one)) for one in points]


@pytest.mark.long
def test_a_warmth_for_which_the_base_bent_its_h_is_seen():
    tangent, (look,) = _looks(1.0)
    assert winds(tangent.fit)
    assert look.gain > 0.5 * float(tangent.residual @ tangent.residual)
    fit = grown(tangent, look)
    assert fit.total < 0.4 * tangent.fit.total
    assert 0.5 < fit.effect_values["self_heating"][0] * CAPACITY_J_K < 3.0  # on its way: h moves with it


def test_a_campaign_at_one_temperature_has_no_h_to_wind():
    case_c = 15.3  # whose mean rounds to more than itself
    runs = [replace(r, temperature_c=np.full(r.temperature_c.size, case_c)) for r in _campaign(0.0).runs[:2]]
    tangent = Tangent.of(Evidence.of(Campaign(Path("steady"), tuple(runs), "0" * 64)).base().fit)
    assert not winds(tangent.fit)


def test_where_nothing_warms_h_does_not_wind_and_the_far_look_is_spared():
    tangent, found = _looks(0.0)
    assert not winds(tangent.fit)
    assert not found
