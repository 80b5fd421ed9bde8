"""The power stage obeys good commands only, and none for long."""

from __future__ import annotations

import pytest

from mrctl.can.codec import make_encoder
from mrctl.can.database import load_database
from mrctl.plant.coil_driver import TIMEOUT_S, CoilDriver
from mrctl.share_path import share_file

SPEC = load_database(
    share_file("dbc/mrctl.dbc"), {"CurrentCommand": ["Cur_FL", "Cur_FR", "Cur_RL", "Cur_RR"]}
)["CurrentCommand"]
ENCODE = make_encoder(SPEC)


def driver():
    return CoilDriver(SPEC, [3.0, 3.0, 3.0, 1.0])


def test_good_commands_are_obeyed_up_to_each_coils_largest_current():
    stage = driver()
    stage.take(ENCODE((0.5, 1.0, 2.5, 2.0), 0), 0.0)
    assert stage.currents_a(0.01) == pytest.approx([0.5, 1.0, 2.5, 1.0], abs=0.01)
    assert stage.good == 1


def test_without_commands_there_is_no_current():
    assert driver().currents_a(10.0) == [0.0] * 4


def test_silence_drops_the_current_once_and_a_new_command_brings_it_back():
    stage = driver()
    stage.take(ENCODE((1.0,) * 4, 0), 0.0)
    assert stage.currents_a(TIMEOUT_S)[0] == pytest.approx(1.0, abs=0.01)
    assert stage.currents_a(TIMEOUT_S + 0.001) == [0.0] * 4
    stage.currents_a(1.0)
    assert stage.timeouts == 1
    stage.take(ENCODE((2.0,) * 4, 1), 1.0)
    assert stage.currents_a(1.0)[0] == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda data: data[:-1], "malformed"),
        (lambda _: b"", "malformed"),
        (lambda data: data[:-1] + bytes([data[-1] ^ 1]), "crc"),
        (lambda _: ENCODE((2.0,) * 4, 0), "counter"),  # the last frame's counter again
        (lambda _: ENCODE((2.0,) * 4, 9), "counter"),  # a jump
    ],
)
def test_broken_command_changes_nothing(spoil, reason):
    stage = driver()
    stage.take(ENCODE((1.0,) * 4, 0), 0.0)
    stage.take(spoil(ENCODE((2.0,) * 4, 1)), 0.002)
    assert stage.currents_a(0.003)[0] == pytest.approx(1.0, abs=0.01)
    assert dict(stage.rejected) == {reason: 1}


def test_after_a_jump_of_the_counter_the_next_in_order_is_obeyed():
    stage = driver()
    for counter in (0, 9, 10):
        stage.take(ENCODE((float(counter > 9),) * 4, counter), 0.0)
    assert stage.currents_a(0.0)[0] == pytest.approx(1.0, abs=0.01)


def test_lost_frames_do_not_matter():
    stage = driver()
    for counter in (14, 1, 6):
        stage.take(ENCODE((1.5,) * 4, counter), 0.0)
    assert stage.good == 3
