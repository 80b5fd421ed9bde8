"""A later effect that acts by itself, and one that mends the form of the first."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from discover.hidden import rich

from mrctl.discover.elsewhere import elsewhere
from mrctl.discover.evidence import Evidence
from mrctl.discover.grow import grown_by, settled
from mrctl.discover.proof import prove
from mrctl.identify.effects_fit import Effects
from mrctl.model.effects.registry import effect

N = 4000
STOP = np.maximum(np.abs(np.sin(np.arange(N) / 150.0)) - 0.8, 0.0) * 3000.0  # silent for half of the time
SPRING = 400.0 * np.sin(np.arange(N) / 150.0) + 900.0  # never silent


class _Model:
    """One record of a base of no force and one effect that makes a given force."""

    def __init__(self, force, residual, effects):
        self.records, self.layout, self.effects = [None], SimpleNamespace(size=2), effects
        self._force, self._residual = force, residual

    def with_effects(self, effects):
        return _Model(np.zeros(N), self._residual, effects)

    def predict(self, theta):
        assert theta.size == self.layout.size + self.effects.size
        return [self._force]

    def residuals(self, _):
        return [self._residual]

    def weighed(self, _, x):
        return x


def _proof(force, residual):
    effects = Effects((effect("end_stop"),))
    theta = np.zeros(2 + effects.size)
    return SimpleNamespace(fit=SimpleNamespace(model=_Model(force, residual, effects), theta=theta))


def _beside(force, missed):
    noise = np.random.default_rng(1).normal(0.0, 5.0, N)
    before, after = _proof(force, noise + missed), _proof(force, noise[30:])  # its start left out
    return elsewhere(before, after, {"end_stop"})


def test_what_acts_everywhere_takes_as_much_where_the_stop_is_silent():
    beside = _beside(STOP, np.full(N, 20.0))
    assert beside.to_all == pytest.approx(1.0, abs=0.1)
    assert beside.of_left == pytest.approx(20.0**2 / (20.0**2 + 5.0**2), abs=0.02)
    assert beside.samples == pytest.approx(np.mean(STOP < 1.0), abs=0.05)


def test_what_mends_the_form_of_the_stop_takes_nothing_there():
    beside = _beside(STOP, 0.1 * STOP)
    assert beside.to_all == pytest.approx(0.0, abs=0.1)
    assert beside.of_left == pytest.approx(0.0, abs=0.1)


def test_beside_a_spring_that_is_never_silent_nothing_is_said():
    assert _beside(SPRING, np.full(N, 20.0)) is None


def test_tables_are_smoothed_anew_once_the_error_has_gone():
    campaign = rich({"gas_spring": {"preload_n": 0.0, "stiffness_n_m": 4000.0, "progression_per_m": 0.0}})
    evidence = Evidence.of(replace(campaign, runs=campaign.runs[:8]))
    base = evidence.base()
    first = prove(grown_by(base.fit, effect("gas_spring"), (0.0, 4000.0, 0.0, 0.0)), evidence.folds)
    again = settled(first, evidence.folds)
    assert first.mean_square < 0.5 * base.mean_square
    assert again.mean_square <= first.mean_square
    assert np.mean(again.fit.model.noise_n**2) < 0.5 * np.mean(first.fit.model.noise_n**2)
    assert settled(again, evidence.folds) is again
