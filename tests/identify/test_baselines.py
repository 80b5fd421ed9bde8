"""The other models' fits: each finds the parameters of data that its own equations made."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mrctl.errors import InputError
from mrctl.identify.baselines import BASELINES, fit_baselines
from mrctl.measurements.run import Campaign, Run
from mrctl.model.baselines.bouc_wen import SPENCER_1997, BoucWen
from mrctl.model.baselines.liu import viscosity_pa_s
from mrctl.plant.spencer import simulate_bouc_wen

RATE_HZ = 500.0
NOISE_N = 2.0
T = np.arange(round(1.2 * RATE_HZ)) / RATE_HZ
OMEGA = 5.0 * math.pi


def moving(force, levels, amplitude_m=0.024, warm=(25.0,), noise_n=NOISE_N):
    """A campaign of sines, one run for each current and temperature; force(x, v, i, T) makes its force."""
    random = np.random.default_rng(4)
    x, v = amplitude_m * np.sin(OMEGA * T), amplitude_m * OMEGA * np.cos(OMEGA * T)
    a = -(OMEGA**2) * x
    runs = []
    for level in levels:
        for c in warm:
            i = np.full(T.size, level) if np.ndim(level) == 0 else level
            temperature = np.full(T.size, c)
            f = force(x, v, i, temperature) + noise_n * random.standard_normal(T.size)
            name = f"{len(runs)}"
            runs.append(Run(name, Path(f"{name}.csv"), T, v, i, temperature, f, x, a, RATE_HZ))
    return Campaign(Path("made"), tuple(runs), "0" * 64)


def fitted(campaign, name):
    (fit,) = fit_baselines(campaign, [name])
    assert fit.name == name
    return fit, {key: q.value for key, q in fit.parameters.items()}


def test_liu_finds_the_viscous_length_the_field_force_and_the_exponent():
    def force(_x, v, i, c):
        mu = np.array([viscosity_pa_s(one) for one in c])
        return 5000.0 * mu * v + 700.0 * i**0.8 * np.sign(v)

    fit, found = fitted(moving(force, (0.0, 1.0, 2.0, 3.0), warm=(30.0, 80.0)), "Liu")
    assert found["viscous_length"] == pytest.approx(5000.0, rel=2e-3)
    assert found["field_force"] == pytest.approx(700.0, rel=1e-3)
    assert found["exponent"] == pytest.approx(0.8, abs=2e-3)
    assert fit.errors.rmse_n < 1.02 * NOISE_N


def test_reader_finds_the_corner_and_the_forces_at_each_current():
    corner_hz, tops = 12.0, {0.0: 200.0, 1.0: 700.0, 2.0: 1100.0}
    a = 2.0 * math.pi * corner_hz

    def force(_x, v, i, _c):
        back = np.array([tops[float(one)] for one in i]) * np.tanh(v / 0.1) / np.tanh(0.024 * OMEGA / 0.1)
        # Eq. 3.2 between samples, in closed form for a straight line: x' = a (u - x).
        out, gain = np.empty_like(back), math.exp(-a / RATE_HZ)
        out[0] = back[0]
        for k in range(1, back.size):
            slope = (back[k] - back[k - 1]) * RATE_HZ
            out[k] = back[k] - slope / a + gain * (out[k - 1] - back[k - 1] + slope / a)
        return out

    fit, found = fitted(moving(force, tuple(tops)), "Reader")
    assert found["corner"] == pytest.approx(corner_hz, rel=0.02)
    for level, top in tops.items():
        assert found[f"f({level:.3g} A)"] == pytest.approx(top, rel=0.01)
    assert fit.errors.rmse_n < 1.1 * NOISE_N


def test_the_plain_bouc_wen_model_finds_its_yield_force_and_damping():
    saturation = 2.0
    truth = BoucWen(
        400.0, 120.0, 0.0, math.inf, 0.0, 1500.0, 0.01, 3e4, 2.4e5, 1e6, 4e5, 300.0, 2.0, 1e5
    )  # fmt: skip
    z0 = math.sqrt(truth.a / (truth.gamma + truth.beta))

    def force(x, v, i, _c):
        return simulate_bouc_wen(truth, RATE_HZ, x, v, -saturation * np.expm1(-i / saturation))

    fit, found = fitted(moving(force, (0.0, 1.0, 2.0, 3.0)), "Bouc-Wen")
    assert fit.errors.rmse_n < 1.1 * NOISE_N
    assert found["yield_a"] == pytest.approx(truth.alpha_a_n_m * z0, rel=0.02)
    assert found["yield_b"] == pytest.approx(truth.alpha_b_n_m * z0, rel=0.02)
    assert found["c0_a"] == pytest.approx(400.0, rel=0.02)
    assert found["saturation"] == pytest.approx(saturation, rel=0.03)
    assert found["sharpness"] == pytest.approx(truth.a / z0, rel=0.05)
    assert found["offset"] == pytest.approx(-15.0, abs=1.0)


def test_spencers_model_finds_spencers_damper():
    def force(x, v, i, _c):
        return simulate_bouc_wen(SPENCER_1997, RATE_HZ, x, v, i)

    campaign = moving(force, (0.0, 0.75, 1.5, 2.25))
    fit, found = fitted(campaign, "Spencer")
    assert fit.errors.rmse_n < 1.2 * NOISE_N
    assert found["c0_a"] == pytest.approx(2100.0, rel=0.03)
    assert found["c1_a"] == pytest.approx(28300.0, rel=0.05)
    yielded = math.sqrt(SPENCER_1997.a / (SPENCER_1997.gamma + SPENCER_1997.beta))
    assert found["yield_b"] == pytest.approx(SPENCER_1997.alpha_b_n_m * yielded, rel=0.03)
    # What it was not shown: half the stroke, another current.
    (unseen,) = moving(force, (1.1,), amplitude_m=0.012, noise_n=0.0).runs
    assert np.sqrt(np.mean((fit.predict(unseen) - unseen.force_n)[150:] ** 2)) < NOISE_N


def test_a_current_that_steps_shows_the_lag_of_the_drive():
    steps = np.where(np.floor(2.5 * T) % 2 == 0, 0.5, 2.0)

    def force(x, v, i, _c):
        return simulate_bouc_wen(SPENCER_1997._replace(eta_1_s=60.0), RATE_HZ, x, v, i)

    _, found = fitted(moving(force, (steps, 2.5 - steps)), "Spencer")
    assert found["eta"] == pytest.approx(60.0, rel=0.1)


def test_a_name_that_is_none_is_named_with_those_that_are():
    campaign = moving(lambda _x, v, _i, _c: 100.0 * v, (1.0,))
    with pytest.raises(InputError, match=r"Preisach.*" + "Reader"):
        fit_baselines(campaign, ["Preisach"])
    assert list(BASELINES) == ["Reader", "Liu", "Bouc-Wen", "Spencer"]


def test_progress_names_each_model_in_turn():
    told = []
    campaign = moving(lambda _x, v, i, _c: (100.0 + i) * v, (0.0, 1.0))
    fit_baselines(campaign, ["Liu"], lambda *what: told.append(what))
    assert told == [(0, 1, "Liu"), (1, 1, "done")]
