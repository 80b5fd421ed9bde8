"""What a filter took off the velocity is put back, and neither taken for physics nor found where none was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from discover.campaigns import campaign, every, road, shipped, with_effect
from discover.hidden import among
from scipy.integrate import cumulative_trapezoid
from scipy.signal import butter, filtfilt

from mrctl.discover.channels.sharpened import Smoothing
from mrctl.discover.diagnose import diagnose
from mrctl.discover.evidence import Evidence
from mrctl.discover.noise.motion_noise import noise_spectrum
from mrctl.discover.reports.figures import diagnosis_figures
from mrctl.identify.records import records_of
from mrctl.measurements.run import Campaign, Run
from mrctl.model.damper import Damper
from mrctl.simulate import simulate

RATE_HZ, FINE, SMOOTHED_HZ, NOISE_N, NOISE_M_S = 500.0, 10, 35.0, 5.0, 2e-4
ALONE = ("displacement_m", "acceleration_m_s2")


def _velocity_only(run: Run, smoothed_hz: float | None, seed: int) -> Run:
    v = run.velocity_m_s + np.random.default_rng(seed).normal(0.0, NOISE_M_S, len(run))
    if smoothed_hz is not None:
        v = filtfilt(*butter(2, smoothed_hz, fs=RATE_HZ), v)
    x = cumulative_trapezoid(v, run.time_s, initial=0.0)
    x -= np.polyval(np.polyfit(run.time_s, x, 1), run.time_s)
    a = np.gradient(v, run.time_s)
    return replace(run, velocity_m_s=v, displacement_m=x, acceleration_m_s2=a, derived=ALONE)


def _campaign(smoothed_hz: float | None, effect: str | None = None, **parameters: float) -> Campaign:
    damper = shipped() if effect is None else with_effect(shipped(), effect, **parameters)

    runs = [_steady(damper, k, current_a) for k, current_a in enumerate((0.0, 0.4, 1.0, 2.5))]
    return campaign(*(_velocity_only(run, smoothed_hz, k) for k, run in enumerate(runs)))


def _steady(damper: Damper, seed: int, current_a: float) -> Run:
    """Random motion at one current, simulated finely."""
    fine = road(damper, 4.0, FINE * RATE_HZ, seed)
    current = np.full(len(fine), current_a)
    motion = fine.velocity_m_s, current, fine.temperature_c, fine.displacement_m, fine.acceleration_m_s2
    force = simulate(damper, fine.dt_s, *motion)
    force += np.random.default_rng(seed).normal(0.0, NOISE_N, len(fine))
    return every(replace(fine, name=f"{current_a:g}A.csv", current_a=current, force_n=force), FINE)


@pytest.mark.long
def test_a_smoothed_velocity_is_no_missing_physics():
    found = diagnose(_campaign(SMOOTHED_HZ))
    assert found.verdict == "none"
    assert found.evidence.smoothing is not None
    took = found.evidence.smoothing.frequency_hz(
        0.03
    )  # a Butterworth's to and fro: 1 / (1 + (f / cut-off)^4)
    assert took == pytest.approx(SMOOTHED_HZ * (1.0 / 0.97 - 1.0) ** 0.25, rel=0.15)
    figures = diagnosis_figures(found)
    assert figures["channels"]["velocity_smoothed"]["order"] in (2, 4)
    assert "The velocity was smoothed, 3 % of it gone at" in figures["words"]


def test_a_velocity_as_sharp_as_its_motion_is_left_alone():
    evidence = Evidence.of(_campaign(None))
    assert evidence.sharpened(evidence.base().fit) is evidence


@pytest.mark.long
def test_what_is_missing_is_named_behind_a_smoothed_velocity_too(monkeypatch):
    among(monkeypatch, "quadratic_damping", "viscous_damping", "sensor_delay", "fluid_inertia")
    found = diagnose(_campaign(SMOOTHED_HZ, "quadratic_damping", coefficient_n_s2_m2=900.0))
    assert found.effects == ("quadratic_damping",)


def test_a_motion_is_put_back_to_its_ends():
    t = np.arange(3000) / RATE_HZ
    true = 0.2 * np.sin(2.0 * np.pi * 9.0 * t) + 0.1 * np.sin(2.0 * np.pi * 14.0 * t + 1.0)
    run = replace(road(shipped(), 6.0, RATE_HZ), velocity_m_s=true)
    (record,) = records_of((_velocity_only(run, None, 3),))
    f = np.fft.rfftfreq(t.size, 1.0 / RATE_HZ)
    smoothing = Smoothing(2, 2e-3)
    less = np.fft.irfft(np.fft.rfft(true) / (1.0 + (2.0 * np.pi * f * 2e-3) ** 2), t.size)
    spectrum = noise_spectrum([record])
    assert spectrum is not None
    back = smoothing.undone(replace(record, velocity_m_s=less), spectrum).velocity_m_s
    assert np.std(back - true) < 0.1 * np.std(less - true)
    assert np.max(np.abs(back - true)) < 0.5 * np.max(np.abs(less - true))
