"""Inverse then forward: the wish comes back, without current spikes."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model.dampers import magneride

from mrctl.model.forward import ForwardModel
from mrctl.model.inverse import InverseModel

DAMPER = magneride()


def track(damper, rate_hz, current_of_time, temperature_c, frequency_hz=2.387, cycles=6):
    """A wish made by the forward model itself, so within reach; wish, force, wanted and found current."""
    dt = 1.0 / rate_hz
    time = np.arange(int(rate_hz * cycles / frequency_hz)) * dt
    velocity = 0.381 * np.cos(2.0 * np.pi * frequency_hz * time)
    wanted = current_of_time(time)
    wish_model, force_model, inverse = (
        ForwardModel(damper, dt),
        ForwardModel(damper, dt),
        InverseModel(damper, dt),
    )
    first = (velocity[0], wanted[0], temperature_c)
    wish_model.settle(*first)
    force_model.settle(*first)
    wish = np.array([wish_model.step(v, i, temperature_c) for v, i in zip(velocity, wanted, strict=True)])
    inverse.reset(wish[0], wanted[0])
    found = np.array([inverse.step(f, v, temperature_c) for f, v in zip(wish, velocity, strict=True)])
    force = np.array([force_model.step(v, i, temperature_c) for v, i in zip(velocity, found, strict=True)])
    settled = slice(len(time) // cycles, None)
    return wish[settled], force[settled], wanted[settled], found[settled]


def percent_of_peak(wish, force):
    return 100.0 * np.sqrt(np.mean((force - wish) ** 2)) / np.max(np.abs(wish))


@pytest.mark.parametrize("rate_hz", [500.0, 1000.0, 2000.0])
@pytest.mark.parametrize("temperature_c", [25.0, 55.0, 85.0])
def test_a_smooth_wish_within_reach_is_tracked(rate_hz, temperature_c):
    for amperes in (1.0, 2.0, 3.0):
        wish, force, _, _ = track(DAMPER, rate_hz, lambda t, i=amperes: np.full_like(t, i), temperature_c)
        assert percent_of_peak(wish, force) < 3.5
    wish, force, _, _ = track(
        DAMPER, rate_hz, lambda t: 1.75 + 1.2 * np.sin(2.0 * np.pi * 0.7 * t), temperature_c
    )
    assert percent_of_peak(wish, force) < 3.5


def test_refinement_beats_the_inverse_filter_alone():
    plain = dataclasses.replace(DAMPER, refine_cutoff_hz=None)
    errors = [
        percent_of_peak(*track(d, 2000.0, lambda t: np.full_like(t, 2.0), 55.0)[:2]) for d in (plain, DAMPER)
    ]
    assert errors[1] < errors[0] / 3.0


def test_weighting_by_authority_calms_the_current_and_tracks_no_worse(monkeypatch):
    """Against the bare inverse, whose current runs to its ends where g vanishes (the spikes of Fig. 9.6)."""

    def at_2_a():
        wish, force, wanted, found = track(DAMPER, 1000.0, lambda t: np.full_like(t, 2.0), 55.0)
        return percent_of_peak(wish, force), found - wanted

    weighted_error, weighted = at_2_a()
    monkeypatch.setattr("mrctl.model.inverse.AUTHORITY_TIME_S", 1e-15)
    bare_error, bare = at_2_a()
    assert np.max(np.abs(bare)) > 0.95  # it hits the largest current, 3 A
    assert np.std(weighted) < 0.75 * np.std(bare)
    assert abs(weighted.mean()) < 0.1
    assert weighted_error <= bare_error


@settings(max_examples=200, deadline=None)
@given(
    samples=st.lists(
        st.tuples(st.floats(-1e4, 1e4), st.floats(-3.0, 3.0) | st.just(0.0), st.floats(-60.0, 200.0)),
        min_size=1,
        max_size=50,
    )
)
def test_every_current_is_finite_in_range_and_within_slew(samples):
    dt = 0.001
    inverse = InverseModel(DAMPER, dt)
    before = 0.0
    for force, velocity, temperature in samples:
        current = inverse.step(force, velocity, temperature)
        assert math.isfinite(current)
        assert 0.0 <= current <= DAMPER.current_max_a
        assert abs(current - before) <= DAMPER.current_slew_a_s * dt + 1e-12
        before = current


def test_the_current_is_continuous_in_velocity_through_zero():
    """A hair of velocity on either side of zero makes no difference to the command."""

    def after(velocity):
        inverse = InverseModel(DAMPER, 0.001)
        inverse.reset(500.0, 1.5)
        return inverse.step(500.0, velocity, 50.0)

    values = [after(v) for v in np.linspace(-1e-4, 1e-4, 41)]
    assert np.max(np.abs(np.diff(values))) < 1e-3
    assert after(0.0) == 1.5


def test_forward_model_settles_to_its_static_force():
    model = ForwardModel(DAMPER, 0.001)
    model.settle(0.2, 1.5, 50.0)
    first = model.step(0.2, 1.5, 50.0)
    for _ in range(500):
        last = model.step(0.2, 1.5, 50.0)
    assert first == pytest.approx(last, rel=1e-9)
