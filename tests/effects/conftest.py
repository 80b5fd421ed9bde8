"""A typical damper and a rich drive, for the tests of effects."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mrctl.model.damper import Damper, EffectSetting, Span
from mrctl.model.filters import Filter
from mrctl.model.static import static_tables
from mrctl.simulate import Run

RATE_HZ = 2000.0
DT_S = 1.0 / RATE_HZ


def make_damper(rate_hz: float = RATE_HZ) -> Damper:
    """Filters as printed, corrected; at rates that these cannot be carried to, a lag of 5 ms."""
    if rate_hz < 250.0:
        decay = math.exp(-1.0 / (rate_hz * 0.005))
        forward = inverse = Filter.of(rate_hz, (1.0 - decay,), (1.0, -decay))
    else:
        forward = Filter.of(RATE_HZ, (0.2166, -0.4128, 0.1964), (1.0, -2.738, 2.4986, -0.7604))
        inverse = Filter.of(RATE_HZ, (3.375, -2.455, -3.281, 2.549), (1.0, -0.4968, -0.2855, -0.02928))
    velocity = np.linspace(-1.5, 1.5, 61)
    shape = 0.85 * np.tanh(velocity / 0.08) + 0.1 * velocity
    return Damper(
        static_tables(
            (0.0, 0.5, 1.0, 2.0, 3.0),
            (300.0, 700.0, 1200.0, 1900.0, 2400.0),
            velocity.tolist(),
            shape.tolist(),
            (20.0, 40.0, 60.0, 90.0),
            (1.2, 1.0, 0.9, 0.8),
            (1.05, 1.0, 0.95, 0.92),
            0.1,
            0.5,
        ),
        forward,
        inverse,
        60.0,
        3.0,
        2000.0,
        Span(-1.5, 1.5),
        Span(20.0, 90.0),
        Span(0.0, 3.0),
    )


def with_effects(damper: Damper, **effects: dict[str, float]) -> Damper:
    return replace(damper, effects=tuple(EffectSetting(name, values) for name, values in effects.items()))


def make_drive(seconds: float = 4.0, dt_s: float = DT_S) -> Run:
    """Two sines of motion (25 mm, up to 0.7 m/s), current up and down in steps and ramps, a warming case."""
    t = np.arange(round(seconds / dt_s)) * dt_s
    slow, fast = 2 * np.pi * 1.3, 2 * np.pi * 6.1
    x = 0.018 * np.sin(slow * t) + 0.007 * np.sin(fast * t + 1.0)
    v = 0.018 * slow * np.cos(slow * t) + 0.007 * fast * np.cos(fast * t + 1.0)
    a = -0.018 * slow**2 * np.sin(slow * t) - 0.007 * fast**2 * np.sin(fast * t + 1.0)
    steps = np.array([0.0, 1.5, 0.4, 2.5, 1.0, 0.0, 3.0, 0.2])[(t / 0.25).astype(int) % 8]
    ramps = 1.5 + 1.4 * np.sin(2 * np.pi * 0.9 * t)
    current = np.where(t < seconds / 2, steps, ramps)
    return Run.of(dt_s, v, current, 30.0 + 40.0 * t / seconds, x, a)


@pytest.fixture(scope="session")
def damper() -> Damper:
    return make_damper()


@pytest.fixture(scope="session")
def drive() -> Run:
    return make_drive()
