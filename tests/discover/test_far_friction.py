"""A large friction that is elastic over a millimetre, in one steady motion: the base has its knee in g."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.looks import looks
from mrctl.measurements.run import Campaign, Run
from mrctl.model.effects.registry import effect

RATE_HZ, NOISE_N = 500.0, 1.5
FRICTION_N, PRESLIDING_M, VISCOUS_N_S_M = 90.0, 1e-3, 550.0


def _friction(v: np.ndarray) -> np.ndarray:
    """F dz/dx = (1 - z sign(v)) / presliding, a tenth of a sample at a time."""
    z, out = 0.0, np.empty(v.size)
    for k, speed in enumerate(v):
        for _ in range(10):
            z += (speed - abs(speed) * z) * 0.1 / RATE_HZ / PRESLIDING_M
        out[k] = FRICTION_N * z
    return out


def _campaign() -> Campaign:
    random, runs = np.random.default_rng(4), []
    t = np.arange(int(4.0 * RATE_HZ)) / RATE_HZ
    w = 2.0 * np.pi * 1.5
    x, v, a = 0.035 * np.sin(w * t), 0.035 * w * np.cos(w * t), -0.035 * w**2 * np.sin(w * t)
    for k in range(3):
        force = VISCOUS_N_S_M * v + _friction(v) + random.normal(0.0, NOISE_N, t.size)
        steady = np.full(t.size, 0.1), np.full(t.size, 30.0)
        runs.append(Run(f"{k}", Path(f"{k}.csv"), t, v, *steady, force, x, a, RATE_HZ))
    return Campaign(Path("friction"), tuple(runs), "0" * 64)


def test_a_friction_that_the_base_has_in_its_g_is_seen():
    tangent = Tangent.of(Evidence.of(_campaign()).base().fit)
    friction, elastic = effect("coulomb_friction"), effect("preyield_stiffness")
    far, other = sorted(looks(tangent, [friction, elastic]), key=lambda look: look.effect.name)
    assert far.gain > 0.7 * other.gain > 0.0
    assert far.values[0] > 0.7 * FRICTION_N
    (near,) = looks(tangent, [replace(friction, far=None)])
    assert near.gain < 0.2 * far.gain
