"""A damper of another kind than the base: Bouc and Wen's, by equations of the test's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from discover.hidden import among

from mrctl.discover.diagnose import diagnose
from mrctl.measurements.run import Campaign, Run

RATE_HZ, FINER = 400.0, 20
NOISE_N = 4.0
VISCOUS_N_S_M, SPRING_N_M = 700.0, 900.0
TURN_PER_M2, SHARPNESS = 5e6, 2.0  # beta = gamma, and A = 2 beta z_max^2 with z_max = 1e-3 m


def _force(x: np.ndarray, v: np.ndarray, current_a: float) -> np.ndarray:
    """F = c v + k x + alpha(i) z, dz/dt = A v - gamma |v| z |z| - beta v z^2, by small Heun steps."""
    alpha = (80.0 + 500.0 * np.tanh(current_a / 1.2)) / 1e-3
    fine = np.interp(np.arange(v.size * FINER) / FINER, np.arange(v.size), v)
    dt = 1.0 / (RATE_HZ * FINER)

    def slope(z: float, speed: float) -> float:
        return 2.0 * TURN_PER_M2 * 1e-6 * speed - TURN_PER_M2 * z * abs(z) * (
            abs(speed) + np.copysign(1.0, z) * speed
        )

    z, course = 0.0, np.empty(fine.size)
    for k, speed in enumerate(fine):
        course[k] = z
        first = slope(z, speed)
        z += 0.5 * dt * (first + slope(z + dt * first, speed))
    return VISCOUS_N_S_M * v + SPRING_N_M * x + alpha * course[::FINER]


def _campaign() -> Campaign:
    random, runs = np.random.default_rng(5), []
    for hz, amplitude_m in ((0.7, 0.03), (3.0, 0.015)):
        for current_a, case_c in ((0.0, 25.0), (0.6, 45.0), (1.8, 30.0)):
            t = np.arange(int(2.0 * RATE_HZ)) / RATE_HZ
            swell = 0.6 + 0.4 * np.sin(2.0 * np.pi * 0.3 * t + hz)
            x = amplitude_m * swell * np.sin(2.0 * np.pi * hz * t)
            v = np.gradient(x, 1.0 / RATE_HZ)
            force = _force(x, v, current_a) + random.normal(0.0, NOISE_N, t.size)
            name = f"{hz:g}Hz_{current_a:g}A"
            steady = np.full(t.size, current_a), np.full(t.size, case_c)
            a = np.gradient(v, 1.0 / RATE_HZ)
            runs.append(Run(name, Path(f"{name}.csv"), t, v, *steady, force, x, a, RATE_HZ))
    return Campaign(Path("bouc_wen"), tuple(runs), "0" * 64)


@pytest.mark.long
def test_each_of_its_terms_is_named_and_nothing_else(monkeypatch):
    """The smaller terms take a percent of what the elastic part takes: that they have one size tells them."""
    terms = "preyield_stiffness", "viscous_damping", "gas_spring"
    among(monkeypatch, *terms, "coulomb_friction", "fluid_inertia")
    result = diagnose(_campaign())
    assert result.verdict == "found"
    assert set(result.effects) == set(terms)
    values = result.final.fit.effect_values
    assert abs(values["viscous_damping"][0] / VISCOUS_N_S_M - 1.0) < 0.02
    assert abs(values["gas_spring"][1] / SPRING_N_M - 1.0) < 0.02
    assert result.final.mean_square < 1.3 * NOISE_N**2
