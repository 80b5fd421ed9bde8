"""A true effect has one size at all conditions; what would have to change with them is another."""

from dataclasses import replace

import pytest
from hidden import among, few, one_frequency, rich

from mrctl.discover.diagnose import diagnose
from mrctl.discover.evidence import Evidence
from mrctl.discover.reports.figures import verdict_words
from mrctl.discover.verdict import stands as module
from mrctl.discover.verdict.constancy import BY_RUN, LEVELS, SIZES, Change, changes_of
from mrctl.model.effects.base import CONDITIONS
from mrctl.model.effects.registry import effects

SPRING = {"preload_n": 0.0, "stiffness_n_m": 4000.0, "progression_per_m": 0.0}


def _stiffer_with_current(share):
    """A spring of 4 N/mm at 1.5 A whose stiffness grows by that share of itself an ampere."""
    plain = rich()
    runs = [
        replace(r, force_n=r.force_n + 4000.0 * (1.0 + share * (r.current_a - 1.5)) * r.displacement_m)
        for r in plain.runs
    ]
    return replace(plain, runs=tuple(runs))


def _fit(campaign, name):
    evidence = Evidence.of(campaign)
    effect = effects()[name]
    return evidence.base([effect], {name: effect.typical}), effect


def test_a_true_effect_has_one_size():
    proof, spring = _fit(rich({"gas_spring": SPRING}), "gas_spring")
    changes = changes_of(proof.fit, [spring])
    assert {"current", "velocity", "frequency", "temperature"} <= {c.signal for c in changes}
    assert not [c for c in changes if c.certain]


def test_one_that_grows_with_the_current_is_seen_to():
    proof, spring = _fit(_stiffer_with_current(0.3), "gas_spring")
    first = changes_of(proof.fit, [spring])[0]
    assert first.certain
    assert first.effect == "gas_spring"
    assert first.signal in {"current", "temperature"}  # the warm runs are those with the larger currents
    assert 1.2 < first.where_high < 1.8


def test_a_form_that_is_one_of_many_is_not_asked_for_one_size_there():
    proof, spring = _fit(_stiffer_with_current(0.3), "gas_spring")
    free = replace(spring, shape_over=frozenset({"current", "temperature"}))
    changes = changes_of(proof.fit, [free])
    assert changes
    assert not {"current", "temperature"} & {c.signal for c in changes}


@pytest.mark.long
def test_what_would_have_to_change_is_not_named_and_the_verdict_says_so(monkeypatch):
    among(monkeypatch, "gas_spring", "fluid_inertia", "coulomb_friction")
    result = diagnose(few(_stiffer_with_current(0.25)))
    assert "gas_spring" not in result.effects
    (change,) = [c for c in result.changes if c.effect == "gas_spring"]
    assert f"{change.words}: it is not what is missing." in verdict_words(result)


@pytest.mark.long
def test_what_has_rivals_stays_for_the_next_run_to_decide(monkeypatch):
    monkeypatch.setattr(
        module, "changes_of", lambda _, chosen: [Change(e.name, "current", 1.5, 0.01) for e in chosen]
    )
    result = diagnose(one_frequency({"gas_spring": SPRING}))
    assert result.verdict == "ambiguous"
    assert "gas_spring" in result.effects
    assert not result.changes


def test_effects_can_name_every_condition_that_is_asked():
    assert {*SIZES, *LEVELS, *BY_RUN} == CONDITIONS


def test_a_change_in_words():
    change = Change("gas_spring", "current", 0.5, 0.05)
    assert change.words == "gas_spring would have to be 3.0 times as large where the current is low"
    assert Change("gas_spring", "speed", -0.2, 0.1).words.endswith("there only where the speed is low")
    assert not Change("gas_spring", "current", 0.9, 0.001).certain
    assert not Change("gas_spring", "current", 0.5, 0.2).certain
