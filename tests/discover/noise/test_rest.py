"""Where a run rests its velocity is noise, by which a friction would slide to nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrctl.discover.evidence import Evidence
from mrctl.discover.noise.motion_noise import noise_spectrum
from mrctl.discover.noise.rest import WINDOW_S, rests, stilled
from mrctl.identify.records import Record
from mrctl.measurements.run import Campaign, Run
from mrctl.model.effects.registry import effect

RATE_HZ, NOISE_M_S, NOISE_N = 500.0, 1e-3, 3.0
T = np.arange(int(4.0 * RATE_HZ)) / RATE_HZ
STUCK_N, PRESLIDING_M, LEVEL_N = 60.0, 1e-4, 900.0
REST_S, BURST_S = 0.6, 1.0


def _burst(t: np.ndarray) -> np.ndarray:
    """The velocity of a motion that rests, moves for a while, and rests again."""
    since = np.mod(t, REST_S + BURST_S) - REST_S
    swell = np.where(since > 0.0, np.sin(np.pi * since / BURST_S) ** 2, 0.0)
    return 0.3 * swell * np.sin(2.0 * np.pi * 3.0 * since)


def _record(v: np.ndarray, noise_m_s: float = NOISE_M_S) -> Record:
    noisy = v + np.random.default_rng(3).normal(0.0, noise_m_s, v.size) if noise_m_s else v
    steady = np.full(v.size, 1.0), np.full(v.size, 30.0)
    x, a = np.cumsum(v) / RATE_HZ, np.gradient(noisy) * RATE_HZ
    return Record(0, RATE_HZ, noisy, *steady, LEVEL_N * np.tanh(v / 0.05), x, a)


@pytest.mark.parametrize("noise_m_s", [0.0, NOISE_M_S])
def test_it_rests_between_two_motions_and_nowhere_else(noise_m_s):
    record = _record(_burst(T), noise_m_s)
    resting = rests(record, noise_spectrum([record]))
    moving = np.abs(_burst(T)) > 0.02
    assert not resting[moving].any()
    assert resting[_burst(T) == 0.0].mean() > 0.9


@pytest.mark.parametrize(
    "v", [0.2 * np.sin(2.0 * np.pi * T), 6e-3 * np.sin(2.0 * np.pi * 0.5 * T), np.full(T.size, 4e-4)]
)
def test_what_turns_or_creeps_does_not_rest(v):
    noise = noise_spectrum([_record(_burst(T))])
    assert not rests(_record(v), noise).any()


def test_an_actuator_that_hunts_does_not_rest_for_the_force_goes_with_it():
    """As small as noise is, and as white."""
    noise = noise_spectrum([_record(_burst(T))])
    hunting = _burst(T) + np.random.default_rng(7).normal(0.0, NOISE_M_S, T.size)
    moved = _record(hunting, noise_m_s=0.0)
    assert not rests(moved, noise).any()
    assert rests(replace(moved, force_n=_record(_burst(T)).force_n), noise).any()


def test_a_run_is_cut_to_where_its_first_rest_ends_unless_the_current_changes_in_it():
    record = _record(_burst(T))
    noise = noise_spectrum([record])
    cut, rest_s = stilled(record, noise)
    assert rest_s == pytest.approx(float(np.mean(_burst(T) == 0.0)) * T.size / RATE_HZ, abs=4.0 * WINDOW_S)
    assert (len(record) - len(cut)) / RATE_HZ == pytest.approx(REST_S, abs=WINDOW_S)
    assert np.count_nonzero(cut.velocity_m_s == 0.0) > 0.8 * REST_S * RATE_HZ
    stepped = replace(record, current_a=np.where(T < 0.5 * REST_S, 0.0, 1.0))
    assert len(stilled(stepped, noise)[0]) == len(record)
    turning = _record(0.2 * np.sin(2.0 * np.pi * T))
    assert stilled(turning, noise) == (turning, 0.0)


def _stuck(seed: int) -> Campaign:
    """A friction that holds at rest what it had, as LuGre's does, before each run's start too."""
    random, runs, fine = np.random.default_rng(seed), [], 10
    t = np.arange(T.size * fine) / RATE_HZ / fine
    for k, current_a in enumerate((0.5, 1.0, 1.5)):
        v = _burst(t + 0.1 * k) * (0.6 + 0.2 * k)
        z, friction = (-1.0) ** k, np.empty(t.size)
        for n, speed in enumerate(v):
            z += (speed - abs(speed) * z) / PRESLIDING_M / RATE_HZ / fine
            friction[n] = STUCK_N * z
        force = (LEVEL_N * current_a * np.tanh(v / 0.05) + friction)[::fine]
        v, x = v[::fine], (np.cumsum(v) / RATE_HZ / fine)[::fine]
        a = np.gradient(v) * RATE_HZ
        columns = (
            np.full(T.size, current_a),
            np.full(T.size, 30.0),
            force + random.normal(0.0, NOISE_N, T.size),
        )
        noisy = v + random.normal(0.0, NOISE_M_S, v.size)
        runs.append(Run(f"{k}", Path(f"{k}.csv"), T, noisy, *columns, x, a, RATE_HZ))
    return Campaign(Path("stuck"), tuple(runs), "0" * 64)


def test_a_friction_stays_where_it_was_while_a_run_rests():
    evidence = Evidence.of(_stuck(1))
    friction = effect("coulomb_friction")
    proof = evidence.base([friction])
    assert proof.fit.effect_values["coulomb_friction"][0] == pytest.approx(STUCK_N, rel=0.1)
    resting = [np.abs(r.velocity_m_s) == 0.0 for r in evidence.full]
    errors = evidence.steady_errors(proof.fit)
    still = [
        e[rest[:: r.finer][-e.size :]] for e, rest, r in zip(errors, resting, evidence.full, strict=True)
    ]
    assert np.sqrt(np.mean(np.concatenate(still) ** 2)) < 0.2 * STUCK_N
