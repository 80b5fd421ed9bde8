"""A damper behind a dashpot: Spencer's, by equations of the test's own.

Its knee is where alpha z over the dashpot is: at another speed with each current, which no f g h has.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.grow import grown
from mrctl.discover.fits.screen import Screen
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.looks import looks
from mrctl.measurements.run import Campaign, Run
from mrctl.model.effects.registry import effect

RATE_HZ, FINER = 400.0, 10
NOISE_N = 4.0
DASHPOT_N_S_M, SPRING_N_M = 28e3, 3500.0
YIELD_M = 1e-4


def _force(x: np.ndarray, v: np.ndarray, current_a: float) -> np.ndarray:
    """F = c1 dy/dt + k x, c1 dy/dt = alpha z + c0 u, u = v - dy/dt, dz/dt = (u - |u| z) / length."""
    alpha, c0 = 90.0 + 440.0 * current_a, 2100.0 + 350.0 * current_a
    fine = np.interp(np.arange(v.size * FINER) / FINER, np.arange(v.size), v)
    dt = 1.0 / (RATE_HZ * FINER)
    z, series = 0.0, np.empty(fine.size)
    for k, speed in enumerate(fine):
        bleed = (alpha * z + c0 * speed) / (c0 + DASHPOT_N_S_M)
        series[k] = DASHPOT_N_S_M * bleed
        way = (speed - bleed) * dt / YIELD_M
        z = np.sign(way) + (z - np.sign(way)) * np.exp(-abs(way)) if way else z
    return series[::FINER] + SPRING_N_M * x


def _campaign() -> Campaign:
    random, runs = np.random.default_rng(8), []
    for hz, amplitude_m in ((0.6, 0.02), (2.5, 0.012)):
        for current_a in (0.0, 0.75, 1.5, 2.25):
            t = np.arange(int(4.0 * RATE_HZ)) / RATE_HZ
            swell = 0.55 + 0.45 * np.sin(2.0 * np.pi * 0.25 * t + hz)
            x = amplitude_m * swell * np.sin(2.0 * np.pi * hz * t)
            v = np.gradient(x, 1.0 / RATE_HZ)
            force = _force(x, v, current_a) + random.normal(0.0, NOISE_N, t.size)
            name = f"{hz:g}Hz_{current_a:g}A"
            steady = np.full(t.size, current_a), np.full(t.size, 25.0)
            a = np.gradient(v, 1.0 / RATE_HZ)
            runs.append(Run(name, Path(f"{name}.csv"), t, v, *steady, force, x, a, RATE_HZ))
    return Campaign(Path("spencer"), tuple(runs), "0" * 64)


def test_the_dashpot_in_series_is_seen_though_no_small_step_leads_to_it():
    """Spring and viscous part are still missing: the dashpot makes up for some of them."""
    evidence = Evidence.of(_campaign())
    base = evidence.base()
    tangent = Tangent.of(base.fit)
    mount = effect("mount_compliance")
    (look,) = looks(tangent, [mount])
    fit = grown(tangent, look)
    taken = 2.0 * (base.fit.total - fit.total)
    assert max(gain for gain, _ in Screen(tangent).glance(mount)) < 0.2 * taken
    assert look.gain > 0.8 * taken
    assert abs(fit.effect_values["mount_compliance"][1] / DASHPOT_N_S_M - 1.0) < 0.3
    assert fit.total < 0.6 * base.fit.total
