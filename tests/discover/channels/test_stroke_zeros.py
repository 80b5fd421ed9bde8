"""A stroke that was integrated has its zero where no file tells, and a stop is at one place."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from discover.hidden import NOISE_N, few, rich

from mrctl.discover import taken_anew
from mrctl.discover.channels.stroke_zeros import stroke_zeros
from mrctl.discover.evidence import Evidence
from mrctl.discover.taken_anew import centred
from mrctl.model.effects.registry import effect

STOP = {
    "clearance_m": 0.026,
    "force_at_1mm_n": 150.0,
    "exponent": 1.5,
    "damping_n_s_m": 0.0,
    "middle_m": 0.0,
    "lag_s": 0.0,
}
LOST, BY_M, TILT_M = 1, 2e-3, 1e-3
ZERO_M = 7e-4  # of a measured stroke, as sensors are set


def _evidence(derived=(), by_m=0.0, tilt_m=0.0):
    """Runs that reach a stop, one with its zero elsewhere; what all say to be derived."""
    plain = few(rich({"end_stop": STOP}))
    runs = [replace(r, derived=derived) for r in plain.runs if not r.name.startswith("5Hz")]
    x = runs[LOST].displacement_m
    runs[LOST] = replace(runs[LOST], displacement_m=x + by_m + tilt_m * np.linspace(-1.0, 1.0, x.size))
    return Evidence.of(replace(plain, runs=tuple(runs)))


def _with_stop(evidence):
    stop = effect("end_stop")
    return evidence.base([stop], {stop.name: stop.vector(STOP)})


@cache
def _sound():
    evidence = _evidence()
    return evidence, _with_stop(evidence)


@cache
def _drifting():
    evidence = _evidence(("displacement_m",), BY_M, TILT_M)
    return evidence, _with_stop(evidence)


def test_a_stop_tells_where_a_stroke_has_its_zero_and_how_it_drifts():
    (_, proof), (lost, _) = _sound(), _drifting()
    model, count = proof.fit.model.on(lost.full), len(lost.full)
    found = stroke_zeros(model, proof.fit.theta, [True] * count, [True] * count)
    assert found[LOST] == pytest.approx([-BY_M, -TILT_M], abs=3e-4)
    assert not np.delete(found, LOST, axis=0).any()
    assert not stroke_zeros(model, proof.fit.theta, [False] * count, [True] * count).any()


@pytest.mark.long
def test_with_it_little_but_noise_is_left():
    lost, bent = _drifting()
    placed, mended = centred(lost, bent)
    assert mended.mean_square < 3.0 * NOISE_N**2 < 0.01 * bent.mean_square
    assert np.argmax(placed.centres_m) == LOST
    assert mended.fit.effect_values["end_stop"][0] == pytest.approx(STOP["clearance_m"], abs=1e-4)


def test_a_stroke_that_was_measured_keeps_its_zero():
    evidence, proof = _sound()
    assert centred(evidence, proof) == (evidence, proof)


@pytest.mark.long
def test_unless_a_model_then_takes_most_of_what_it_left():
    lost = _evidence((), ZERO_M)
    bent = _with_stop(lost)
    placed, mended = centred(lost, bent)
    assert mended.mean_square < 3.0 * NOISE_N**2 < 0.1 * bent.mean_square
    assert placed.centres_m[LOST] == pytest.approx(ZERO_M, abs=2e-4)


def test_nor_is_anything_fitted_where_moving_a_measured_stroke_alone_takes_little(monkeypatch):
    evidence, proof = _sound()
    hardly = np.full((len(evidence.full), 2), [1e-5, 0.0])
    asked = []
    monkeypatch.setattr(taken_anew, "is_quiet", lambda _: False)
    monkeypatch.setattr(Evidence, "budget", lambda *_: SimpleNamespace(excess=1.0))
    monkeypatch.setattr(taken_anew, "stroke_zeros", lambda *_: asked.append(1) or hardly)
    monkeypatch.setattr(taken_anew, "fitted_to", lambda *_: pytest.fail("fitted"))
    assert centred(evidence, proof) == (evidence, proof)
    assert asked
