"""Campaigns of the shipped damper whose noise and missing effect are known."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from mrctl.calibration import load_calibration
from mrctl.measurements.run import Campaign, Run
from mrctl.model.damper import Damper, EffectSetting
from mrctl.simulate import simulate

CALIBRATION = Path(__file__).resolve().parents[2] / "config" / "calibration.yaml"


def shipped() -> Damper:
    return load_calibration(CALIBRATION).damper


def with_effect(damper: Damper, name: str, **parameters: float) -> Damper:
    return replace(damper, effects=(EffectSetting(name, parameters),))


def picked(run: Run, samples: slice) -> Run:
    """The run with some of its samples in every channel."""
    channels = [f.name for f in fields(Run) if isinstance(getattr(run, f.name), np.ndarray)]
    return replace(run, **{name: getattr(run, name)[samples] for name in channels})


def every(run: Run, kept: int) -> Run:
    """The run as a logger that takes only every so many samples has it."""
    return replace(picked(run, slice(None, None, kept)), sample_rate_hz=run.sample_rate_hz / kept)


def earlier_than_middle(at: np.ndarray, kept: int) -> np.ndarray:
    """How much earlier than mid-interval a step to sample `at` was, where every `kept` are taken."""
    into = (at - 1) % kept + 1  # samples after the last one taken that shows the old value
    return 0.5 - into / kept


def coloured(rng: np.random.Generator, n: int, rms: float, pole: float) -> np.ndarray:
    """First-order noise of a known RMS; pole 0 is white."""
    white = rng.normal(0.0, rms * np.sqrt(1.0 - pole * pole), n + 2000)
    return lfilter([1.0], [1.0, -pole], white)[2000:]


def sine(
    damper: Damper,
    rate_hz: float = 1000.0,
    cycles: float = 9.4,
    frequency_hz: float = 2.387,
    amplitude_m: float = 0.0254,
    current_a: float = 1.0,
    name: str = "sine.csv",
    heating: float = 0.0,
    noise=lambda rng, n: rng.normal(0.0, 20.0, n),
    seed: int = 1,
) -> Run:
    n = round(cycles / frequency_hz * rate_hz)
    t = np.arange(n) / rate_hz
    w = 2.0 * np.pi * frequency_hz
    motion = (
        amplitude_m * w * np.cos(w * t),
        amplitude_m * np.sin(w * t),
        -amplitude_m * w * w * np.sin(w * t),
    )
    return _run(damper, t, rate_hz, motion, np.full(n, current_a), name, heating, noise, seed)


def road(
    damper: Damper,
    seconds: float = 20.0,
    rate_hz: float = 1000.0,
    seed: int = 3,
    name: str = "road.csv",
    noise=lambda rng, n: rng.normal(0.0, 20.0, n),
) -> Run:
    """Narrow-band random motion with a changing current: nothing repeats."""
    rng = np.random.default_rng(seed)
    n = round(seconds * rate_hz)
    t = np.arange(n) / rate_hz
    lines = rng.uniform(0.5, 12.0, 60)
    phase = rng.uniform(0.0, 2.0 * np.pi, 60)
    w = 2.0 * np.pi * lines[:, None]
    size = (0.05 / np.sqrt(60.0)) / lines[:, None]
    angle = w * t + phase[:, None]
    x, v, a = (
        (size * np.sin(angle)).sum(0),
        (size * w * np.cos(angle)).sum(0),
        -(size * w * w * np.sin(angle)).sum(0),
    )
    current = np.repeat(rng.uniform(0.0, 2.5, n // 200 + 1), 200)[:n]
    return _run(damper, t, rate_hz, (v, x, a), current, name, 0.0, noise, seed)


def _run(damper, t, rate_hz, motion, current, name, heating, noise, seed) -> Run:
    v, x, a = motion
    warm = np.full(t.size, 40.0)
    force = simulate(damper, 1.0 / rate_hz, v, current, warm, x, a) * (1.0 - heating * t / t[-1])
    force = force + noise(np.random.default_rng(seed), t.size)
    return Run(
        name=name, file=Path(name), time_s=t, velocity_m_s=v, current_a=current, temperature_c=warm,
        force_n=force, displacement_m=x, acceleration_m_s2=a, sample_rate_hz=rate_hz,
    )  # fmt: skip


def silence(_: np.random.Generator, n: int) -> np.ndarray:
    return np.zeros(n)


def campaign(*runs: Run) -> Campaign:
    return Campaign(Path("campaign"), runs, "0" * 64)


def grid(damper: Damper, count: int = 40) -> Campaign:
    """Sines of four frequencies, two strokes and five currents."""
    runs = [
        sine(
            damper,
            frequency_hz=(0.7, 1.4, 2.387, 4.1)[k % 4],
            amplitude_m=(0.025, 0.012)[(k // 4) % 2],
            current_a=(0.0, 0.5, 1.0, 1.5, 2.0)[(k // 8) % 5],
            name=f"run{k:02d}.csv",
            seed=k,
        )
        for k in range(count)
    ]
    return campaign(*runs)
