"""Starts of unknown past: which a fit leaves out, and what that is worth."""

from __future__ import annotations

import numpy as np
import pytest

from mrctl.identify import hysteresis
from mrctl.identify.joint import JointModel
from mrctl.identify.records import Record
from mrctl.identify.slow_poles import misfit
from mrctl.identify.start import layout_for, start_values

RATE_HZ = 200.0


class _Watched(JointModel):
    """A joint model that says which starts each of its costs left out."""

    def cost(self, theta):
        self.seen.append((self.settle_blocks(theta, self.records[0]), self._slowest_s(theta)))
        return super().cost(theta)


@pytest.fixture(scope="module")
def begun():
    """A model of two runs behind a lag of 20 ms, and its vector with a faster one."""
    t = np.arange(800) / RATE_HZ
    noise = np.random.default_rng(3)
    flat, records = np.ones(t.size), []
    for k, hz in enumerate((1.0, 2.3)):
        v = 0.3 * np.sin(2.0 * np.pi * hz * t)
        force = np.zeros(t.size)
        static = 800.0 * np.tanh(v / 0.05)
        for n in range(1, t.size):
            force[n] = force[n - 1] + (static[n] - force[n - 1]) * (1.0 - np.exp(-1.0 / (0.02 * RATE_HZ)))
        force += noise.normal(0.0, 8.0, t.size)
        records.append(Record(k, RATE_HZ, v, flat, 30.0 * flat, force, flat, flat))
    model = _Watched(layout_for(records, order=1), records)
    theta = start_values(model)
    theta[model.layout.parts["filter"]] = hysteresis.lag(40.0)[[0, 3]]
    return model, theta


def test_a_fit_goes_on_with_the_starts_that_it_began_with(begun):
    """Were it each step's own, the cost would jump where a pole begins to show."""
    model, theta = begun
    model.seen = []
    fit = model.fit(theta, rounds=1, iterations=12)
    left_out, slowest = zip(*model.seen, strict=True)
    assert len(set(left_out)) == 1
    assert max(slowest) > 2.0 * min(slowest)  # the lag itself did move
    assert fit.model.settle_blocks(fit.theta, model.records[0]) == left_out[0]  # what is asked of it as well
    fit.model.seen = []
    again = fit.model.fit(fit.theta, rounds=1, iterations=1)
    assert again.model.settle_blocks(fit.theta, model.records[0]) > left_out[0]  # the next has its own, ...
    assert fit.model.settle_blocks(fit.theta, model.records[0]) == left_out[0]  # ... and the first keeps its


def test_where_the_filter_has_no_past_the_fluid_has(begun):
    """One that yields answers to the last millimetres as well."""
    model, _ = begun
    fresh = JointModel(model.layout.with_order(0), model.records)
    record = model.records[0]
    assert fresh.settle_blocks(np.zeros(fresh.size), record) == round(0.02 * RATE_HZ)


def test_what_is_left_out_makes_no_fit_better(begun, monkeypatch):
    """Of two fits that err alike everywhere, none is ahead for the starts that it does not count."""
    model, theta = begun
    model.seen = []
    fit = model.fit(theta, rounds=1)
    noise = np.random.default_rng(1).normal(0.0, 50.0, 800)
    monkeypatch.setattr(fit.model, "residuals", lambda _theta: [noise, noise])
    whole = misfit(fit)
    monkeypatch.setattr(fit.model, "residuals", lambda _theta: [noise[80:], noise[80:]])
    assert misfit(fit) == pytest.approx(whole, rel=0.01)
