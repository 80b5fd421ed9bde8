"""The tick commands what it commanded when the golden runs were recorded."""

from __future__ import annotations

import pytest
from runtime.bench import DAMPERS, SPECS
from runtime.golden import FOLDER, RUNS, commands

from mrctl.can.codec import make_decoder

COMMAND_ID, STATE_ID = SPECS["CurrentCommand"].linux_id, SPECS["ControllerState"].linux_id
UNIT_A = SPECS["CurrentCommand"].signals[0].factor
_decode = make_decoder(SPECS["CurrentCommand"])


def parsed(line):
    pairs = (frame.split("#") for frame in line.split())
    return {int(can_id, 16): bytes.fromhex(data) for can_id, data in pairs}


@pytest.mark.parametrize("name", RUNS)
def test_every_command_is_the_recorded_one(name):
    """To one count: the last bit of a libm is not promised to be the same everywhere."""
    recorded = (FOLDER / f"{name}.txt").read_text(encoding="ascii").splitlines()
    now = commands(name)
    assert len(now) == len(recorded) == RUNS[name][3]
    currents = set()
    for n, (mine, theirs) in enumerate(zip(map(parsed, now), map(parsed, recorded), strict=True)):
        assert mine.keys() == theirs.keys(), f"tick {n}"
        ours, expected = _decode(mine[COMMAND_ID]), _decode(theirs[COMMAND_ID])
        assert len(ours) == len(DAMPERS)
        assert max(abs(a - b) for a, b in zip(ours, expected, strict=True)) < 1.5 * UNIT_A, f"tick {n}"
        assert mine.get(STATE_ID) == theirs.get(STATE_ID), f"tick {n}"
        currents.update(expected)
    assert len(currents) > 100  # the run moves the current about
