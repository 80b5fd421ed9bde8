"""Dampers drawn at random from inside the model class, and what a dyno would measure of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import cont2discrete

from mrctl.measurements.run import Campaign, Run
from mrctl.model.damper import Damper, Span
from mrctl.model.filters import Filter
from mrctl.model.static import static_tables
from mrctl.simulate import simulate

PAPER_FILTER = Filter.of(2000.0, (0.2166, -0.4128, 0.1964), (1.0, -2.738, 2.4986, -0.7604))
NOISE_N = 5.0
TOP_M_S = 0.45


def random_filter(random: np.random.Generator) -> Filter:
    """Third order, unit gain, poles from 3 to 150 Hz, real or a pair."""
    p = 2 * np.pi * np.exp(random.uniform(np.log(3.0), np.log(150.0), 3))
    damping = random.uniform(0.4, 1.0)
    pair = random.random() < 0.5
    den = np.convolve([1.0, p[0]], [1.0, 2 * damping * p[1], p[1] ** 2]) if pair else np.poly(-p)
    zeros = 2 * np.pi * np.exp(random.uniform(np.log(4.0), np.log(200.0), 2))
    num = np.poly(-zeros)
    b, a, _ = cont2discrete((num / num[-1] * den[-1], den), 1 / 2000.0, "bilinear")
    return Filter.of(2000.0, b.ravel(), a)


def random_damper(seed: int) -> Damper:
    """Tables with their own knots, an off state, a filter."""
    random = np.random.default_rng(seed)
    i = np.array([0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0])
    f0, top = random.uniform(150.0, 500.0), random.uniform(1200.0, 3500.0)
    f = f0 + (top - f0) * np.tanh(i / random.uniform(1.5, 3.0))
    v = np.linspace(0.0, TOP_M_S, int(random.integers(12, 26)))
    side = np.tanh(v / random.uniform(0.02, 0.12)) + random.uniform(0.1, 0.6) * v / TOP_M_S
    side /= side[-1]
    g = np.concatenate([-random.uniform(0.8, 1.0) * side[:0:-1], side])
    t = np.array([10.0, 25.0, 40.0, 55.0, 70.0, 85.0, 100.0])
    static = static_tables(
        i.tolist(),
        f.tolist(),
        np.concatenate([-v[:0:-1], v]).tolist(),
        g.tolist(),
        t.tolist(),
        np.exp(-random.uniform(0.002, 0.007) * (t - 25.0)).tolist(),
        np.exp(-random.uniform(0.0005, 0.003) * (t - 25.0)).tolist(),
        float(random.choice([0.0, 0.1, 0.2])),
        float(random.choice([0.5, 0.8, 1.0])),
    )
    h = PAPER_FILTER if random.random() < 0.3 else random_filter(random)
    none = Filter.of(2000.0, (1.0,), (1.0,))
    wide = Span(-1e3, 1e3)
    return Damper(static, h, none, None, 4.0, 100.0, wide, wide, wide)


@dataclass
class Bench:
    """A damper on a dyno with white noise on the force."""

    damper: Damper
    random: np.random.Generator
    noise_n: float = NOISE_N

    def run(self, name, t, v, current_a, temperature_c) -> Run:
        rate = 1.0 / (t[1] - t[0])
        i, temperature = (
            np.broadcast_to(np.asarray(x, dtype=float), t.shape).copy() for x in (current_a, temperature_c)
        )
        x = np.cumsum(v) / rate
        a = np.gradient(v, 1 / rate)
        force = simulate(self.damper, 1 / rate, v, i, temperature, x, a)
        noisy = force + self.noise_n * self.random.normal(size=t.size)
        return Run(name, Path(f"{name}.csv"), t, v, i, temperature, noisy, x, a, rate)

    def sine(self, name, rate, hz, amplitude, cycles, current_a, temperature_c) -> Run:
        t = np.arange(int(cycles / hz * rate)) / rate
        x = amplitude * np.sin(2 * np.pi * hz * t) * np.clip(t / 0.5, 0, 1)
        return self.run(name, t, np.gradient(x, 1 / rate), current_a, temperature_c)

    def road(self, rate, seconds):
        n = int(rate * seconds)
        f = np.fft.rfftfreq(n, 1 / rate)
        s = self.random.normal(size=f.size) + 1j * self.random.normal(size=f.size)
        s = s * (f > 0.3) / np.sqrt((1 + (f / 2) ** 2) * (1 + (f / 15) ** 4))
        v = np.fft.irfft(s, n)
        return np.arange(n) / rate, np.clip(v * 0.12 / v.std(), -TOP_M_S, TOP_M_S)


def _paper(bench: Bench) -> list[Run]:
    fahrenheit = (84, 97, 111, 122, 132, 141, 151, 162, 171, 181)
    return [
        bench.sine(f"{i:g}A_{f}F", 2000.0, 2.387, 0.0254, 9, i, (f - 32) / 1.8)
        for i in (0.0, 1.0, 2.0, 3.0)
        for f in fahrenheit
    ]


def _single(bench: Bench) -> list[Run]:
    return [bench.sine("single", 2000.0, 2.387, 0.0254, 9, 2.0, 40.0)]


def _several_frequencies(bench: Bench) -> list[Run]:
    return [
        bench.sine(f"{hz}Hz_{i}A", 1000.0, hz, amplitude, 8, i, 30.0)
        for hz, amplitude in ((0.5, 0.05), (1.0, 0.05), (2.0, 0.03), (5.0, 0.01))
        for i in (0.0, 0.3, 1.7, 2.9)
    ]


def _rates(bench: Bench) -> list[Run]:
    return [
        bench.sine(f"{rate:g}Hz_{i:g}A", rate, 2.387, 0.0254, 9, i, 35.0)
        for rate in (500.0, 1000.0, 2000.0)
        for i in (0.0, 1.0, 2.0, 3.0)
    ]


def _sweep(bench: Bench) -> list[Run]:
    t = np.arange(12000) / 1000.0
    runs = []
    for c in (25.0, 50.0, 75.0):
        runs.append(bench.sine(f"up_{c:g}C", 1000.0, 3.0, 0.02, 36, t / 4.0, c))
        runs.append(bench.sine(f"down_{c:g}C", 1000.0, 1.5, 0.035, 18, 3.0 - t / 4.0, c))
    return runs


def _steps(bench: Bench) -> list[Run]:
    levels = np.array([0, 1, 2, 3, 0.5, 0, 3, 1.5, 0, 2.0])
    runs = []
    for c in (30.0, 60.0, 90.0):
        t, v = bench.road(1000.0, 10.0)
        runs.append(bench.run(f"steps_{c:g}C", t, v, levels[np.minimum(t.astype(int), 9)], c))
    return runs


def _road(bench: Bench) -> list[Run]:
    runs = []
    for k in range(4):
        t, v = bench.road(1000.0, 12.0)
        i = np.interp(t, np.arange(61) / 5.0, bench.random.uniform(0, 3, 61))
        runs.append(bench.run(f"road_{k}", t, v, i, np.linspace(30 + 15 * k, 40 + 15 * k, t.size)))
    return runs


def _only_off(bench: Bench) -> list[Run]:
    return [bench.sine(f"{c:g}C", 2000.0, 2.387, 0.0254, 9, 0.0, c) for c in (30.0, 50.0, 70.0)]


PROTOCOLS = {
    "paper": _paper,
    "single": _single,
    "several frequencies": _several_frequencies,
    "rates": _rates,
    "sweep": _sweep,
    "steps": _steps,
    "road": _road,
    "only off": _only_off,
}


def protocol(kind: str, bench: Bench) -> Campaign:
    """A campaign of this kind."""
    return Campaign(Path(kind), tuple(PROTOCOLS[kind](bench)), "0" * 64)
