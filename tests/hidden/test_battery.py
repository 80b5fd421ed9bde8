"""A fixed small part of the hidden-effect battery; `python tests/hidden/battery.py` runs all of it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from discover.hidden import among

sys.path.insert(0, str(Path(__file__).parent))

import battery
import follow
import generate
import score

# Chosen before any of them was diagnosed: of an effect the damper of the fewest samples, and one of none.
SEED = 11
CASES = [pytest.param("A", 3, marks=pytest.mark.long), ("B", 0)]


@pytest.mark.parametrize(("family", "number"), CASES)
def test_a_hidden_effect_is_named_and_nothing_is_named_where_there_is_none(tmp_path, family, number):
    name, hidden = generate.make_case(SEED, family, number, tmp_path)
    _, answer = battery.diagnosed(tmp_path / name)
    assert score.judge(hidden, answer) == "exact", (hidden["effects"], answer)


@pytest.mark.long
def test_the_run_that_an_ambiguous_answer_proposes_resolves_it(tmp_path, monkeypatch):
    """A mass at one frequency: the base goes so far to make up for it that beside that base a spring seems to
    have its course even with a run at another frequency."""
    among(monkeypatch, "fluid_inertia", "gas_spring", "coulomb_friction", "force_offset")
    key = (282, "D", 9)
    name, hidden = generate.make_case(*key, tmp_path)
    _, answer = battery.diagnosed(tmp_path / name, key, rounds=1)
    assert answer["verdict"] == "ambiguous"
    assert set(answer["effects"]) >= set(hidden["effects"])
    (after,) = answer["followed"]
    assert follow.right(hidden, after), after
