"""A search in several processes finds what one process finds, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from discover.campaigns import campaign, shipped, sine, with_effect

from mrctl.discover.evidence import Evidence
from mrctl.discover.search.levels import search_level
from mrctl.identify import parallel
from mrctl.model.effects.base import Effect
from mrctl.model.effects.registry import effect

SPRING = {"preload_n": 40.0, "stiffness_n_m": 3000.0, "progression_per_m": 0.0}


@pytest.fixture
def candidates() -> list[Effect]:
    return [effect(name) for name in ("gas_spring", "fluid_inertia", "coulomb_friction")]


def test_one_process_and_three_find_the_same(monkeypatch, candidates):
    damper = with_effect(shipped(), "gas_spring", **SPRING)
    runs = [
        sine(damper, frequency_hz=hz, amplitude_m=0.01, current_a=1.0, name=f"{hz}.csv", seed=int(hz))
        for hz in (2.0, 5.0)
    ]

    def found(processors):
        monkeypatch.setattr(parallel, "_here", parallel._Crew(processors))
        evidence = Evidence.of(campaign(*runs))
        base = evidence.base()
        return base, search_level(base, candidates, evidence.folds)

    (_, alone), (base, level) = found(1), found(3)
    assert level.trials[0].effect.name == "gas_spring"
    for one, other in zip(alone.trials, level.trials, strict=True):
        assert np.array_equal(one.fit.theta, other.fit.theta)
        assert one.gain == other.gain
    for one, other in zip(alone.looks, level.looks, strict=True):
        assert one.gain == other.gain
        assert np.array_equal(one.force, other.force)
    for trial in level.trials:
        assert any(trial.effect is c for c in candidates)
        assert all(r is own for r, own in zip(trial.fit.model.records, base.fit.model.records, strict=True))
