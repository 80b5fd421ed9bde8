"""A fixed small part of the fuzzing; `python tests/fuzz/frames.py` is the whole."""

from __future__ import annotations

import pytest
from fuzz.frames import KINDS, run

from mrctl.can.frames import State


@pytest.mark.parametrize("seed", [1, 2])
def test_no_frame_makes_a_bad_command(seed):
    source, judge, _, seen = run(150_000, seed)
    assert judge.commands > 10_000
    assert set(source.sent) == set(KINDS)
    assert set(seen) == {state.name for state in State}
