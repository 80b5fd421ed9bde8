"""White noise alone is quiet; a force of the damper's in it is not, nor is noise that remembers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from discover.campaigns import coloured

from mrctl.discover.search import quiet
from mrctl.discover.search.quiet import is_quiet
from mrctl.discover.verdict.worth import LEAST_OF_FORCE, SMALL_OF_FORCE

RATE_HZ, RUNS, SAMPLES, NOISE_N, FORCE_N = 500.0, 10, 4000, 5.0, 500.0
T = np.arange(SAMPLES) / RATE_HZ
SLOW_N = np.sqrt(2.0) * FORCE_N * np.sin(2.0 * np.pi * 2.0 * T)


def _leaves(*residuals: np.ndarray, force_n: np.ndarray = SLOW_N) -> SimpleNamespace:
    """As much of a proof as is asked: what its model leaves of each run, and its force in all."""
    records = [SimpleNamespace(force_n=force_n[: rest.size] + rest) for rest in residuals]
    model = SimpleNamespace(
        residuals=lambda _: list(residuals), weighed=lambda _record, force: force, records=records
    )
    whole = float(np.mean(np.concatenate(residuals) ** 2))
    return SimpleNamespace(fit=SimpleNamespace(model=model, theta=None), mean_square=whole)


def _noise(seed: int) -> list[np.ndarray]:
    random = np.random.default_rng(seed)
    return [random.normal(0.0, NOISE_N, SAMPLES) for _ in range(RUNS)]


@pytest.mark.parametrize("seed", range(20))
def test_white_noise_is_quiet(seed):
    assert is_quiet(_leaves(*_noise(seed)))


@pytest.mark.parametrize(
    "force",
    [0.3 * NOISE_N * np.ones(SAMPLES), 0.45 * NOISE_N * np.sin(2.0 * np.pi * 3.0 * T),
     2.0 * NOISE_N * (np.sin(2.0 * np.pi * 2.0 * T) > 0.97)],
    ids=["constant", "sine", "stop"],
)  # fmt: skip
def test_a_force_that_could_be_named_is_not(force):
    for seed in range(5):
        assert not is_quiet(_leaves(*(one + force for one in _noise(seed))))


def test_noise_that_remembers_is_not_told_from_a_force():
    random = np.random.default_rng(1)
    assert not is_quiet(_leaves(*(coloured(random, SAMPLES, NOISE_N, 0.8) for _ in range(RUNS))))


def test_a_run_too_short_to_tell_is_not():
    assert not is_quiet(_leaves(*(one[:40] for one in _noise(1))))


def test_what_a_delay_leaves_is_not_though_it_is_white():
    """Spikes of either sign where a force turns at random: as loud at every frequency."""
    random = np.random.default_rng(7)
    force = FORCE_N * np.sign(random.normal(size=SAMPLES))
    late = 0.005 * (np.roll(force, 1) - force)  # 5 N in RMS where it turned
    residuals = [one + late for one in _noise(2)]
    assert is_quiet(_leaves(*residuals))  # beside another force
    assert not is_quiet(_leaves(*residuals, force_n=force))


@pytest.mark.parametrize(
    ("size", "takes", "is_none"),
    [
        (0.5 * (SMALL_OF_FORCE + LEAST_OF_FORCE), True, True),
        (0.5 * (SMALL_OF_FORCE + LEAST_OF_FORCE), False, False),
        (1.1 * LEAST_OF_FORCE, True, False),  # may be named though finer tables would take it
    ],
)
def test_a_little_that_finer_tables_would_take_is_their_form(monkeypatch, size, takes, is_none):
    """size: of a force left, over the damper's."""
    form = size * FORCE_N * np.sqrt(2.0) * np.sin(2.0 * np.pi * 3.0 * T)  # which does not follow the force
    plain = [0.1 * one for one in _noise(4)]
    monkeypatch.setattr(quiet, "left_by_finer", lambda _: plain if takes else [one + form for one in plain])
    assert is_quiet(_leaves(*(one + form for one in plain))) is is_none


def test_finer_tables_are_not_asked_where_noise_bounds_what_can_be_named(monkeypatch):
    monkeypatch.setattr(quiet, "left_by_finer", lambda _: pytest.fail("asked"))
    form = 0.45 * NOISE_N * np.sin(2.0 * np.pi * 3.0 * T)
    assert not is_quiet(_leaves(*(one + form for one in _noise(4))))
