"""A fixed small part of the guided fuzzing of the tick, unguided; `tests/fuzz/guided.py` is the whole."""

from __future__ import annotations

import pytest
from fuzz.frames import COMMAND_ID
from fuzz.programs import MAPS, SEEDS, Program
from hypothesis import given, settings
from hypothesis import strategies as st


def test_the_seeds_lead_through_the_states():
    states = set()
    for seed in SEEDS:
        program = Program(seed)
        step = program.tick.step

        def watched(frames, periods=1, *, step=step, tick=program.tick):
            out = step(frames, periods=periods)
            states.update(corner.state.name for corner in tick.corners)
            return out

        program.tick.step = watched
        program.run(3000)
        assert program.bus.judge.commands == program.ticks
    assert states == {"INIT", "ACTIVE", "SUBSTITUTE", "LIMP", "OFF"}


@given(st.binary(max_size=400))
@settings(max_examples=60, deadline=None)
def test_no_program_makes_a_bad_command(data):
    Program(data).run(400)


@pytest.mark.parametrize("first", range(len(MAPS)))
def test_a_program_is_judged(first):
    program = Program(bytes([first, 0, 63]))
    step = program.tick.step

    def broken(frames, periods=1):
        frames = step(frames, periods=periods)
        flipped = [(i, bytes([data[0] ^ (i == COMMAND_ID), *data[1:]])) for i, data in frames]
        return flipped if program.ticks == 40 else frames

    program.tick.step = broken
    with pytest.raises(AssertionError):
        program.run(100)
