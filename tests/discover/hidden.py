"""Small campaigns of a damper inside the model class, with or without a hidden effect."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from identify.virtual import Bench, random_damper

from mrctl.discover.evidence import Evidence
from mrctl.measurements.run import Campaign
from mrctl.model.damper import EffectSetting

RATE_HZ = 400.0
NOISE_N = 5.0
LEVELS_A = np.array([0.0, 2.0, 0.5, 3.0, 1.0, 0.0, 1.5, 3.0])


def rich(effects: dict[str, dict[str, float]] | None = None, seed: int = 2) -> Campaign:
    """Sines of several frequencies and currents, and a road with steps of current, cold and warm."""
    bench = bench_of(effects, seed)
    runs = [
        bench.sine(f"{hz:g}Hz_{i:g}A_{c:g}C", RATE_HZ, hz, amplitude, max(3, int(3 * hz)), i, c)
        for hz, amplitude in ((0.5, 0.03), (2.0, 0.02), (5.0, 0.01))
        for i, c in ((0.0, 30.0), (0.5, 60.0), (1.5, 30.0), (3.0, 60.0))
    ]
    for c in (30.0, 60.0):
        t, v = bench.road(RATE_HZ, 5.0)
        current = LEVELS_A[np.minimum((t * 1.5).astype(int), LEVELS_A.size - 1)]
        runs.append(bench.run(f"steps_{c:g}C", t, v, current, c))
    return Campaign(Path("rich"), tuple(runs), "0" * 64)


def few(campaign: Campaign) -> Campaign:
    """A rich campaign's slow and fast sines and roads: enough where time counts."""
    return replace(campaign, runs=tuple(r for r in campaign.runs if not r.name.startswith("2Hz")))


def among(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Only these effects are candidates, where time counts: what is hidden may be mistaken for them."""
    every = Evidence.candidates

    def some(evidence, known):
        candidates, untestable = every(evidence, known)
        return [c for c in candidates if c.name in names], untestable

    monkeypatch.setattr(Evidence, "candidates", some)


def one_frequency(effects: dict[str, dict[str, float]] | None = None, seed: int = 2) -> Campaign:
    """One sine at three steady currents: stroke and acceleration cannot be told apart."""
    bench = bench_of(effects, seed)
    runs = [bench.sine(f"{i:g}A", RATE_HZ, 2.0, 0.02, 10, i, 40.0) for i in (0.5, 1.5, 3.0)]
    return Campaign(Path("one"), tuple(runs), "0" * 64)


def one_current(effects: dict[str, dict[str, float]] | None = None, seed: int = 2) -> Campaign:
    """Sines of several frequencies and strokes at one current: how anything changes with it is not seen."""
    bench = bench_of(effects, seed)
    runs = [
        bench.sine(f"{hz:g}Hz", RATE_HZ, hz, amplitude, max(3, int(3 * hz)), 1.5, 40.0)
        for hz, amplitude in ((0.5, 0.03), (1.0, 0.01), (2.0, 0.02), (4.0, 0.004), (5.0, 0.01))
    ]
    return Campaign(Path("one_current"), tuple(runs), "0" * 64)


def bench_of(effects: dict[str, dict[str, float]] | None, seed: int) -> Bench:
    """The damper with a hidden effect, on a dyno."""
    damper = random_damper(seed)
    settings = tuple(EffectSetting(name, values) for name, values in (effects or {}).items())
    return Bench(replace(damper, effects=settings), np.random.default_rng(seed), NOISE_N)
