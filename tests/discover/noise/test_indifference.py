"""Noise is as loud whatever the damper does, however slow it is; a model's error is not."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from discover.campaigns import coloured
from discover.hidden import rich

from mrctl.discover import diagnose as module
from mrctl.discover.evidence import Evidence
from mrctl.discover.noise.indifference import APART_TWO_S, by_steepness, is_indifferent, swells
from mrctl.discover.noise.spectral_floor import mean_square
from mrctl.discover.verdict.balance import OF_THE_MOTION, balance_of
from mrctl.discover.verdict.structure import structure_of

RUNS, SAMPLES = 6, 4000
RATES = [500.0] * RUNS


def _signals():
    t = np.arange(SAMPLES) / 500.0
    speeds = [np.abs(np.sin(2.0 * np.pi * (0.5 + k) * t)) for k in range(RUNS)]
    currents = [np.full(SAMPLES, 0.4 * k) for k in range(RUNS)]
    forces = [(100.0 + 500.0 * i) * np.minimum(v, 0.3) for v, i in zip(speeds, currents, strict=True)]
    return speeds, forces, currents


def _noise(pole=0.97):
    rng = np.random.default_rng(3)
    return [coloured(rng, SAMPLES, 10.0, pole) for _ in range(RUNS)]


def test_slow_noise_is_indifferent():
    assert is_indifferent(_noise(), _signals(), RATES)


@pytest.mark.parametrize(
    "louder",
    [
        lambda v, _f, _i: 1.0 + 2.0 * v,
        lambda _v, f, _i: 0.2 + f / 200.0,
        lambda _v, _f, i: np.full(SAMPLES, 1.0 + i[0]),
    ],
    ids=["with the speed", "with the force", "in some runs"],
)
def test_what_is_louder_somewhere_is_not(louder):
    signals = _signals()
    errors = [e * louder(*at) for e, at in zip(_noise(0.0), zip(*signals, strict=True), strict=True)]
    assert not is_indifferent(errors, signals, RATES)


def _steep():
    """Of dampers whose force saturates at a small speed, more with more current, in N/(m/s)."""
    speeds, _, currents = _signals()
    return [
        (300.0 + 2000.0 * i) / 0.05 / np.cosh(v / 0.05) ** 2 for v, i in zip(speeds, currents, strict=True)
    ]


def test_a_motions_noise_is_indifferent_but_for_where_the_damper_is_steep():
    steep = _steep()
    of_motion = [s * n / 5000.0 for s, n in zip(steep, _noise(0.9), strict=True)]
    rng = np.random.default_rng(5)
    errors = [e + rng.normal(0.0, 4.0, SAMPLES) for e in of_motion]
    signals = [*_signals(), steep]
    assert not is_indifferent(errors, signals, RATES)
    assert is_indifferent(by_steepness(errors, steep), signals, RATES, APART_TWO_S)


@pytest.mark.parametrize(
    "louder",
    [
        lambda v, _f, _i: 1.0 + 2.0 * v,
        lambda v, _f, i: np.where((v < 0.2) & (i < 0.9), 6.0, 1.0),
        lambda _v, f, _i: 0.2 + f / 200.0,
    ],
    ids=["with the speed", "near standstill, where the current is small", "with the force"],
)
def test_what_is_louder_elsewhere_is_no_motions_noise(louder):
    signals, steep = _signals(), _steep()
    errors = [e * louder(*at) for e, at in zip(_noise(0.0), zip(*signals, strict=True), strict=True)]
    assert not is_indifferent(by_steepness(errors, steep), [*signals, steep], RATES, APART_TWO_S)


def test_what_is_faster_where_the_motion_is_is_not():
    """A sine of the path: as loud everywhere."""
    speeds, forces, currents = _signals()
    speeds = [0.1 * (k + 1) * v for k, v in enumerate(speeds)]
    errors = [10.0 * np.sin(60.0 * np.cumsum(v) / 500.0 + 1.0) for v in speeds]
    assert not is_indifferent(errors, [speeds, forces, currents], RATES)


def test_what_is_left_out_is_not_asked():
    holes = [np.where(np.arange(SAMPLES) % 7 < 3, 0.0, e) for e in _noise()]
    assert is_indifferent(holes, _signals(), RATES)
    assert not is_indifferent([np.zeros(SAMPLES) for _ in range(RUNS)], _signals(), RATES)


@pytest.mark.parametrize("where", ["everywhere", "where the current is high"])
def test_noise_that_remembers_itself_long_leaves_nothing_to_explain(where):
    """60 N with a time constant of 0.25 s: more than any colour would allow."""
    rng = np.random.default_rng(8)
    plain = rich()
    runs = [
        replace(
            r,
            force_n=r.force_n
            + coloured(rng, len(r), 60.0, 0.99) * (1.0 if where == "everywhere" else r.current_a / 1.2),
        )
        for r in plain.runs
    ]
    evidence = Evidence.of(replace(plain, runs=tuple(runs)))
    base = evidence.base()
    left = structure_of(base.fit, evidence.folds)
    balance = balance_of(evidence, base, left, [], bare=True)
    assert balance.cleared is (where == "everywhere")


@pytest.mark.parametrize("of", ["the motion", "what hangs on the current"])
def test_slow_noise_of_the_measured_motion_leaves_nothing_to_explain(of):
    """4 mm/s with a time constant of 50 ms, that its spectrum above 30 Hz does not show; or as much force."""
    rng = np.random.default_rng(8)
    plain = rich()
    noise = [coloured(rng, len(r), 0.004, 0.95) for r in plain.runs]
    runs = [
        replace(r, velocity_m_s=r.velocity_m_s + n)
        if of == "the motion"
        else replace(r, force_n=r.force_n + 3000.0 * n * r.current_a)
        for r, n in zip(plain.runs, noise, strict=True)
    ]
    evidence = Evidence.of(replace(plain, runs=tuple(runs)))
    base = evidence.base()
    balance = balance_of(evidence, base, structure_of(base.fit, evidence.folds), [], bare=True)
    assert balance.cleared is (of == "the motion")
    assert (balance.how == OF_THE_MOTION) is balance.cleared


@pytest.mark.parametrize(
    ("taken", "alone", "verdict"),
    [(5.0, "none", "none"), (20.0, "none", "unexplained"), (5.0, "unexplained", "unexplained")],
)
def test_a_little_that_is_not_borne_out_is_nothing(monkeypatch, taken, alone, verdict):
    """taken: of 100 N² that the base leaves."""
    monkeypatch.setattr(module, "judged_by", lambda *_: SimpleNamespace(verdict=alone))
    judged = SimpleNamespace(
        verdict="unexplained", stands=[None], final=SimpleNamespace(mean_square=100.0 - taken)
    )
    base = SimpleNamespace(mean_square=100.0)
    assert module._less_what_is_slight(None, base, judged).verdict == verdict


def test_zeros_too_large_to_be_taken_out_are_told():
    """30 N up or down in each run: no load cell is trusted to wander so far, but it can be said."""
    plain = rich()
    runs = [replace(r, force_n=r.force_n + 30.0 * (-1.0) ** (k // 2)) for k, r in enumerate(plain.runs)]
    evidence = Evidence.of(replace(plain, runs=tuple(runs)))
    base = evidence.base()
    left = structure_of(base.fit, evidence.folds)
    balance = balance_of(evidence, base, left, [], bare=True)
    assert not balance.cleared
    assert np.sqrt(balance.by_run) == pytest.approx(30.0, rel=0.3)


def _wandering(force_n: np.ndarray, seed: int) -> np.ndarray:
    """A current that hunts at about 3 Hz, by 8 % of the force, its phase wandering."""
    t = np.arange(force_n.size) / 500.0
    phase = np.cumsum(np.random.default_rng(seed).normal(0.0, 0.15, force_n.size)) + 2.0 * np.pi * 3.1 * t
    return 0.08 * np.sin(phase) * force_n


def test_what_does_not_repeat_and_comes_with_the_force_swells():
    speeds, _, currents = _signals()
    forces = [(100.0 + 500.0 * i) * v for v, i in zip(speeds, currents, strict=True)]
    noise = _noise()
    hunting = [_wandering(f, k) for k, f in enumerate(forces)]
    both = [e + h for e, h in zip(_noise(0.0), hunting, strict=True)]
    assert swells(hunting, forces) == pytest.approx(mean_square(hunting), rel=0.01)
    assert swells(both, forces) > 0.5 * mean_square(hunting)
    assert swells(noise, forces) == 0.0
    louder_in_some_runs = [e * (1.0 + 3.0 * k) for k, e in enumerate(noise)]
    assert swells(louder_in_some_runs, forces) == 0.0
    fast = [e * f / 100.0 for e, f in zip(_noise(0.0), forces, strict=True)]
    assert swells(fast, forces) == 0.0
    assert swells([np.zeros(SAMPLES) for _ in range(RUNS)], forces) == 0.0


@pytest.mark.parametrize(("drowned", "verdict"), [(True, "none"), (False, "found")])
def test_a_little_beside_as_much_of_the_motions_noise_is_nothing(monkeypatch, drowned, verdict):
    monkeypatch.setattr(module, "judged_by", lambda *_: SimpleNamespace(verdict="none"))
    judged = SimpleNamespace(verdict="found", stands=[None], final=SimpleNamespace(mean_square=95.0))
    base = SimpleNamespace(mean_square=100.0, fit=None)
    evidence = SimpleNamespace(budget=lambda _: SimpleNamespace(drowned=drowned))
    assert module._less_what_is_slight(evidence, base, judged).verdict == verdict
