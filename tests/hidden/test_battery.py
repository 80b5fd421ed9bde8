"""A fixed small part of the hidden-effect battery; `python tests/hidden/battery.py` runs all of it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import battery
import generate
import score

# Chosen before any of them was diagnosed: every twenty-first single effect, and a damper without one.
SEED = 11
CASES = [("A", 3), ("A", 24), ("A", 45), ("A", 66), ("B", 0)]


@pytest.mark.slow
def test_hidden_effects_are_named_and_nothing_is_named_where_there_is_none(tmp_path):
    hidden = dict(generate.make_case(SEED, family, k, tmp_path) for family, k in CASES)
    answers = dict(battery.diagnosed(tmp_path / name) for name in hidden)
    outcomes = score.table(answers, hidden, each=True)
    singles = [outcomes[name] for name, truth in hidden.items() if truth["family"] == "A"]
    nulls = [outcomes[name] for name, truth in hidden.items() if truth["family"] == "B"]
    assert not {"wrong", "false"} & {*singles, *nulls}
    assert sum(one == "exact" for one in singles) >= len(singles) - 1
