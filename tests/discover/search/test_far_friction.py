"""A friction that the base has in its g: elastic over a millimetre in one motion, or inside the chambers."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from discover.hidden import among
from scipy.signal import butter, lfilter

from mrctl.discover.diagnose import diagnose
from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.screen import Screen
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.far_looks import far_look, promises
from mrctl.discover.search.looks import looks
from mrctl.measurements.run import Campaign, Run
from mrctl.model.effects.registry import effect

RATE_HZ, NOISE_N = 500.0, 1.5
CHAMBER_HZ = 34.0
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
    promised = promises(Screen(tangent), friction, friction.far(Screen(tangent).ranges))
    assert far_look(Screen(tangent), promised).gain == far.gain
    assert far_look(Screen(tangent), []) is None  # what is not worth it


def _inside(seed: int) -> Campaign:
    """A friction on the piston, inside chambers whose compliance filters all that the fluid does."""
    random, runs, fine = np.random.default_rng(seed), [], 10
    t = np.arange(int(3.0 * RATE_HZ) * fine) / RATE_HZ / fine
    chamber = butter(2, CHAMBER_HZ, fs=RATE_HZ * fine)
    for k, (frequency_hz, stroke_m) in enumerate([(1.0, 0.03), (2.0, 0.02), (4.0, 0.02), (7.0, 0.012)]):
        w = 2.0 * np.pi * frequency_hz
        x = stroke_m * np.sin(w * t)
        v, a = w * stroke_m * np.cos(w * t), -(w**2) * x
        current = np.repeat(random.uniform(0.0, 2.0, 10), t.size // 10 + 1)[: t.size]
        fluid = (150.0 + 350.0 * np.tanh(1.2 * current)) * (np.tanh(v / 0.08) + 0.3 * v)
        force = lfilter(*chamber, fluid + FRICTION_N * np.tanh(v / 0.0015))
        force += random.normal(0.0, NOISE_N, t.size)
        channels = (one[::fine] for one in (t, v, current, np.full(t.size, 30.0 + 5.0 * k), force, x, a))
        runs.append(Run(f"{k}", Path(f"{k}.csv"), *channels, RATE_HZ))
    return Campaign(Path("inside"), tuple(runs), "0" * 64)


@pytest.mark.long
def test_a_friction_that_the_chambers_filter_is_named(monkeypatch):
    among(monkeypatch, "coulomb_friction", "preyield_stiffness", "mount_compliance", "off_state_backbone")
    found = diagnose(_inside(5))
    assert found.effects == ("coulomb_friction",)
    (friction,) = (one.trial.fit.effect_values["coulomb_friction"] for one in found.found)
    assert abs(friction[0] - FRICTION_N) < 0.1 * FRICTION_N
    lag_s = math.sqrt(2.0) / (2.0 * math.pi * CHAMBER_HZ)  # and 0.5 for the swing: Butterworth's
    assert abs(friction[4] - lag_s) < 0.25 * lag_s
    assert 0.3 < friction[5] < 0.8
