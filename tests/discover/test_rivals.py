"""An effect that bounds kept from fitting is a rival by its force's course, whatever its shape came to."""

from __future__ import annotations

from dataclasses import replace

import pytest
from discover.campaigns import campaign, shipped, sine, with_effect

from mrctl.discover.evidence import Evidence
from mrctl.discover.rivals import rivals_of
from mrctl.discover.screen import Screen
from mrctl.discover.search import search_level
from mrctl.discover.tangent import Tangent
from mrctl.model.effects.registry import effect

SPRING = {"preload_n": 0.0, "stiffness_n_m": 9000.0, "progression_per_m": 0.0}


@pytest.mark.parametrize("lag_s", [0.0, 0.05])
def test_how_late_no_mass_comes_does_not_hide_that_it_would_have_a_springs_course(lag_s):
    damper = with_effect(shipped(), "gas_spring", **SPRING)
    runs = [
        sine(damper, frequency_hz=5.0, amplitude_m=0.01, current_a=i, name=f"{i}.csv", seed=int(i))
        for i in (1.0, 2.0, 3.0)
    ]
    evidence = Evidence.of(campaign(*runs))
    spring, mass = effect("gas_spring"), effect("fluid_inertia")
    level = search_level(evidence.base(), [spring, mass], evidence.folds)
    chosen = level.trials[0]
    assert chosen.effect is spring
    screen, own = Screen(Tangent.of(level.before.fit)), chosen.fit.effect_values["gas_spring"]
    nothing = screen.at(mass, (0.0, lag_s))
    found = rivals_of(chosen, replace(level, looks=[screen.at(spring, own), nothing]), cleared=True)
    assert [rival.name for rival in found] == ["fluid_inertia"]
