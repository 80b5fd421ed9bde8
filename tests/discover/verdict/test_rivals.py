"""An effect that bounds kept from fitting is a rival by its force's course, whatever its shape came to."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from discover.campaigns import campaign, shipped, sine, with_effect

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.screen import Screen
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.levels import search_level
from mrctl.discover.verdict import rivals
from mrctl.discover.verdict.rivals import rivals_of, simplest
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
    found = rivals_of(chosen, replace(level, looks=[screen.at(spring, own), nothing]))
    assert [rival.name for rival in found] == ["fluid_inertia"]


def _trial(name, left_n2, **values):
    """An effect at its typical parameters, but for those given, that leaves so much of 1000 N²."""
    chosen = effect(name)
    given = tuple(({p.name: p.typical for p in chosen.parameters} | values).values())
    return SimpleNamespace(
        effect=chosen,
        fit=SimpleNamespace(effect_values={name: given}),
        proof=SimpleNamespace(mean_square=left_n2),
        parameters=len(given),
        score=-left_n2,
        gain=1000.0 - left_n2,
    )


@pytest.mark.parametrize(
    ("power", "left_n2", "better"),
    [(0.3, 104.0, "viscous_damping"), (1.0, 104.0, "off_state_backbone"), (0.3, 106.0, "off_state_backbone")],
)
def test_what_does_little_better_only_at_the_ends_of_its_form_gives_way(monkeypatch, power, left_n2, better):
    monkeypatch.setattr(rivals, "contains", lambda *_: False)
    larger, smaller = _trial("off_state_backbone", 100.0, power=power), _trial("viscous_damping", left_n2)
    level = SimpleNamespace(before=SimpleNamespace(mean_square=1000.0), trials=[larger, smaller], looks=[])
    assert simplest(larger, level, [larger, smaller]).effect.name == better
