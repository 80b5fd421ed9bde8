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
@pytest.mark.parametrize(("family", "number"), CASES)
def test_a_hidden_effect_is_named_and_nothing_is_named_where_there_is_none(tmp_path, family, number):
    name, hidden = generate.make_case(SEED, family, number, tmp_path)
    _, answer = battery.diagnosed(tmp_path / name)
    assert score.judge(hidden, answer) == "exact", (hidden["effects"], answer)
