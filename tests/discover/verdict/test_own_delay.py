"""A filter may be late by itself, as the published one is: that is no effect, and no error is left by it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from discover.campaigns import every, road, shipped, with_effect
from discover.hidden import among
from scipy.optimize import least_squares
from scipy.signal import lfilter

from mrctl.discover.diagnose import diagnose
from mrctl.discover.extend import extend
from mrctl.discover.verdict.own_delay import is_filters, with_hold
from mrctl.identify.hysteresis import UNIT_RAD_S, discretise
from mrctl.identify.joint_fit import half_width_95
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper
from mrctl.model.effects.registry import effects
from mrctl.simulate.stages import measured

NOISE_N = 4.0
DELAY = effects()["sensor_delay"]


def _campaign(damper: Damper, seconds: float = 2.5) -> Campaign:
    def noise(rng: np.random.Generator, n: int) -> np.ndarray:
        return rng.normal(0.0, NOISE_N, n)

    runs = [
        road(damper, seconds=seconds, seed=seed, noise=noise, name=f"road_{seed}.csv") for seed in range(4)
    ]
    return Campaign(Path("roads"), tuple(runs), "0" * 64)


def _every_fourth(campaign: Campaign) -> Campaign:
    """The campaign as a slower logger has it."""
    return replace(campaign, runs=tuple(every(run, 4) for run in campaign.runs))


@pytest.mark.long
def test_the_published_filter_alone_is_no_delay():
    result = diagnose(_campaign(shipped()))
    assert (result.verdict, result.effects) == ("none", ())
    assert "taken as its own" in result.hidden["sensor_delay"]
    assert result.final.mean_square < 1.1 * NOISE_N**2


@pytest.mark.long
def test_beside_it_an_effect_is_named_alone_and_leaves_the_noise(monkeypatch):
    among(monkeypatch, "sensor_delay", "quadratic_damping", "viscous_damping", "mount_compliance")
    damper = with_effect(shipped(), "quadratic_damping", coefficient_n_s2_m2=400.0, lag_s=0.0)
    campaign = _campaign(damper, seconds=4.0)
    result = diagnose(campaign)
    assert (result.verdict, result.effects) == ("found", ("quadratic_damping",))
    extension = extend(campaign, (), (effects()["quadratic_damping"],))
    assert extension.rmse_after_n < 1.05 * NOISE_N < extension.rmse_before_n


@pytest.mark.long
def test_a_late_force_is_still_a_delay(monkeypatch):
    among(monkeypatch, "sensor_delay", "fluid_inertia", "preyield_stiffness", "mount_compliance")
    result = diagnose(_campaign(with_effect(shipped(), "sensor_delay", delay_s=3e-3)))
    assert (result.verdict, result.effects) == ("found", ("sensor_delay",))
    assert result.final.fit.effect_values["sensor_delay"][0] == pytest.approx(3.5e-3, abs=0.5e-3)


class _Fit:
    """A fit that found a delay, as far as `is_filters` asks."""

    def __init__(self, delay_s: float, std_s: float, rate_hz: float, finer: int = 1) -> None:
        record = SimpleNamespace(rate_hz=finer * rate_hz, finer=finer)
        self.model = SimpleNamespace(records=[record])
        self.effect_values = {"sensor_delay": (delay_s,)}
        self._std = std_s

    def effect_std(self) -> dict[str, tuple[float, ...]]:
        return {"sensor_delay": (self._std,)}


@pytest.mark.parametrize(
    ("delay_s", "std_s", "rate_hz", "finer", "own"),
    [
        (0.7e-3, 1e-5, 2000.0, 1, True),
        (1.0e-3, 1e-5, 2000.0, 1, False),
        (1.0e-3, 1e-4, 2000.0, 1, True),  # its interval reaches down to what a filter may hold
        (1.9e-3, 1e-3, 2000.0, 1, False),  # twice as much is a delay, however rough its size
        (1.9e-3, 1e-5, 250.0, 1, True),  # half a sample
        (2.3e-3, 2e-4, 250.0, 4, True),  # the sample that was measured counts, not the one simulated
        (2.3e-3, 1e-5, 250.0, 4, False),
    ],
)
def test_what_sampling_may_make_late_is_the_filters_own(delay_s, std_s, rate_hz, finer, own):
    trial = SimpleNamespace(effect=effects()["sensor_delay"], fit=_Fit(delay_s, std_s, rate_hz, finer))
    assert is_filters(trial) is own


def test_of_other_effects_it_is_not_asked():
    trial = SimpleNamespace(effect=effects()["gas_spring"], fit=_Fit(1e-4, 1e-5, 1000.0))
    assert not is_filters(trial)


@pytest.mark.parametrize("rate_hz", [500.0, 1000.0, 2000.0])
def test_what_a_hold_adds_to_a_delay_is_in_its_interval(rate_hz):
    """A plain lag behind a knee, finely simulated, then sampled: the filter that fits best, and the delay."""
    lag_s, delay_s, fine = 5e-3, 4.5e-3, round(20_000.0 / rate_hz)
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 8.0, 1.0 / 20_000.0)
    tones = zip(rng.uniform(0.5, 12.0, 12), rng.uniform(0.0, 6.3, 12), strict=True)
    made = 1000.0 * np.tanh(sum(np.cos(2.0 * np.pi * hz * t + at) for hz, at in tones) / 0.4)
    smooth = np.exp(-1.0 / (20_000.0 * lag_s))
    late = np.interp(t - delay_s, t, lfilter([1.0 - smooth], [1.0, -smooth], made))[::fine]

    def missed(p):
        b, a = discretise(np.array([p[0], p[1]]), rate_hz)
        return (measured([(DELAY, (p[2],))], lfilter(b, a, made[::fine]), 1.0 / rate_hz) - late)[200:]

    found = least_squares(missed, [np.log(1.0 / (lag_s * UNIT_RAD_S)), 0.05, delay_s]).x[2]
    assert found - delay_s > 0.25 / rate_hz
    fit = _Fit(found, 1e-5, rate_hz)
    (std_s,) = with_hold(fit, DELAY.name, fit.effect_std()[DELAY.name])
    assert found - half_width_95(std_s) < delay_s


@pytest.mark.long
def test_half_a_slow_sample_late_is_no_delay():
    """As a velocity differenced backward is, for one."""
    late = with_effect(shipped(), "sensor_delay", delay_s=1.2e-3)
    result = diagnose(_every_fourth(_campaign(late)))
    assert (result.verdict, result.effects) == ("none", ())
