"""Known motions and runs for the tests of the measurements room."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

HEADER = "time_s,velocity_m_s,current_A,temperature_C,force_N"


@dataclass(frozen=True)
class Motion:
    """A sine with a third harmonic: exact displacement, velocity, acceleration."""

    time_s: np.ndarray
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray
    rate_hz: float


def sine(frequency=2.387, cycles=9.0, rate=1000.0, amplitude=0.0127, third=0.1, phase=0.7) -> Motion:
    t = np.arange(int(cycles / frequency * rate)) / rate
    w = 2 * pi * frequency
    x, v, a = np.zeros((3, len(t)))
    for order, share in ((1, 1.0), (3, third)):
        k = order * w
        x += share * amplitude * np.sin(k * t + order * phase)
        v += share * amplitude * k * np.cos(k * t + order * phase)
        a -= share * amplitude * k * k * np.sin(k * t + order * phase)
    return Motion(t, x, v, a, rate)


def damper_force(motion: Motion, current: float = 1.0) -> np.ndarray:
    """A plausible MR damper: saturating, viscous, with a loop."""
    lagged = motion.v - 0.004 * motion.a
    return (200 + 1300 * current) * np.tanh(lagged / 0.05) + 1500 * motion.v


def rows(motion: Motion | None = None, current: float = 1.0, noise: float = 5.0, seed: int = 1) -> np.ndarray:
    """Time, velocity, current, temperature, force as a CSV holds them, with measurement noise."""
    motion = motion or sine()
    rng = np.random.default_rng(seed)
    n = len(motion.time_s)
    force = damper_force(motion, current) + noise * rng.standard_normal(n)
    velocity = motion.v + 1e-3 * rng.standard_normal(n)
    return np.column_stack((motion.time_s, velocity, np.full(n, current), np.full(n, 30.0), force))


def csv_text(table: np.ndarray, header: str = HEADER, delimiter: str = ",", newline: str = "\n") -> str:
    lines = [header.replace(",", delimiter)]
    lines += [delimiter.join(f"{value:.9g}" for value in row) for row in table]
    return newline.join(lines) + newline


def write_csv(path: Path, table: np.ndarray | None = None, **options) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(csv_text(rows() if table is None else table, **options).encode())
    return path
