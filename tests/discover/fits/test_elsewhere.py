"""A later effect that acts by itself, and one that mends the form of the first."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.fits.elsewhere import elsewhere

N = 4000
STOP = np.maximum(np.abs(np.sin(np.arange(N) / 150.0)) - 0.8, 0.0) * 3000.0  # silent for half of the time
SPRING = 400.0 * np.sin(np.arange(N) / 150.0) + 900.0  # never silent


class _Model:
    """One record of a base that makes a given force."""

    def __init__(self, force, residual):
        self.records = [None]
        self._force, self._residual = force, residual

    def predict(self, _):
        return [self._force]

    def residuals(self, _):
        return [self._residual]

    def weighed(self, _, x):
        return x


class _Fit(SimpleNamespace):
    """A model of one effect that makes all of its force."""

    def less(self, names):
        assert names == {"end_stop"}
        return _Fit(model=_Model(np.zeros(N), None), theta=self.theta)


def _proof(force, residual):
    return SimpleNamespace(fit=_Fit(model=_Model(force, residual), theta=np.zeros(2)))


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
