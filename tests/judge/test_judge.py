"""The judge passes what a sound controller sends, and catches every rule when it is broken on purpose."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from replay.recording import CONFIG, candump, live, write

from mrctl.cli.main import main
from mrctl.judge.e2e import crc8h2f, expected_crc
from mrctl.judge.frames import read_dbc
from mrctl.judge.judge import RULES, Judge
from mrctl.judge.limits import default_limits, limits_of_config
from mrctl.share_path import share_file

DBC = share_file("dbc/mrctl.dbc")
BUS = read_dbc(DBC)
LIMITS = limits_of_config(CONFIG, BUS)
COMMAND = BUS.command


@pytest.fixture(scope="module")
def sound():
    rows, _, _ = live(4000)
    return rows


def judged(rows, limits=LIMITS):
    judge = Judge(BUS, limits)
    return [violation for at, can_id, data in rows for violation in judge.see(at / 1e9, can_id, data)]


def rules(violations):
    return {violation.rule for violation in violations}


def with_currents(data, change):
    """A command with its currents changed, counts of 1 mA, and its CRC right again."""
    word = int.from_bytes(data, "little")
    for k, signal in enumerate(COMMAND.signals):
        shift = signal.bits[0]
        raw = change(k, word >> shift & 0x1FFF)
        word = word & ~(0x1FFF << shift) | (raw & 0x1FFF) << shift
    return protected(bytearray(word.to_bytes(8, "little")))


def protected(data):
    data[0] = expected_crc(bytes(data), COMMAND.data_ids)
    return bytes(data)


def spoilt(rows, at, change):
    """The rows with the command number `at` changed; `change` gives a list of rows."""
    out, seen = [], 0
    for row in rows:
        if row[1] == COMMAND.identifier:
            seen += 1
            if seen == at:
                out += change(row)
                continue
        out.append(row)
    return out


def test_the_crc_is_that_of_the_specification():
    assert crc8h2f(b"123456789") == 0xDF
    assert crc8h2f(bytes(4)) == 0x12
    assert crc8h2f(bytes([0xF2, 0x01, 0x83])) == 0xC2


@given(st.binary(min_size=2, max_size=64), st.binary(min_size=16, max_size=16))
def test_its_table_is_the_shift_register(data, data_ids):
    assert expected_crc(data, data_ids) == crc8h2f(data[1:] + data_ids[data[1] % 16 :][:1])


def test_a_sound_controller_breaks_no_rule(sound):
    assert judged(sound) == []


def test_nor_does_one_whose_inputs_are_faulty_or_gone():
    rows, _, _ = live(20_000, faults=True)
    assert judged(rows) == []


SEEDED = {
    "length": lambda row: [(row[0], row[1], row[2][:7])],
    "crc": lambda row: [(row[0], row[1], bytes([row[2][0] ^ 1, *row[2][1:]]))],
    "counter": lambda row: [row, (row[0] + 1000, row[1], row[2])],
    "finite": lambda row: [(row[0], row[1], with_currents(row[2], lambda k, raw: 8191 if k == 2 else raw))],
    "range": lambda row: [(row[0], row[1], with_currents(row[2], lambda k, raw: 3002 if k == 1 else raw))],
    "slew": lambda row: [(row[0], row[1], with_currents(row[2], lambda k, _: 2900 if k == 0 else 0))],
    "cycle": lambda _row: [],
}


@pytest.mark.parametrize("rule", SEEDED)
def test_a_seeded_violation_is_caught(sound, rule):
    limits = replace(LIMITS, late_cycles=1.5) if rule == "cycle" else LIMITS
    found = judged(spoilt(sound, 2000, SEEDED[rule]), limits)
    assert rule in rules(found)
    assert 3.99 < found[0].time_s < 4.01
    assert found[0].frame.startswith(("Cur_", "CurrentCommand"))


def test_one_count_beyond_the_slew_limit_is_caught():
    step = round(LIMITS.slew_a_s["Cur_FL"] * LIMITS.cycle_s * 1000)

    def commands(*counts):
        blank = bytes(8)
        return [
            (
                k * 2_000_000,
                COMMAND.identifier,
                with_currents(bytes([0, k, *blank[2:]]), lambda _i, _r, c=c: c),
            )
            for k, c in enumerate(counts)
        ]

    assert judged(commands(0, step, 2 * step, step)) == []
    assert rules(judged(commands(0, step + 1))) == {"slew"}
    assert rules(judged(commands(step + 1, 0))) == {"slew"}


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_commands_that_come_too_fast_or_too_slow_are_caught(sound, factor):
    commands = [
        (round(at * factor), can_id, data) for at, can_id, data in sound if can_id == COMMAND.identifier
    ]
    assert "cycle" in rules(judged(commands[:400]))


def test_a_current_that_goes_on_without_its_input_is_caught(sound):
    velocity = next(frame for frame in BUS.inputs if frame.name == "RelativeVelocity")
    deaf = [row for row in sound if row[1] != velocity.identifier or row[0] < 4e9]
    found = judged(deaf)
    assert rules(found) == {"timeout"}
    assert 4.05 < found[0].time_s < 4.2  # 50 ms, the way to the limp current, and a few cycles


def test_a_current_without_any_input_is_caught(sound):
    rows = [row for row in sound if row[0] < 3e9]
    at, _, last = next(row for row in reversed(rows) if row[1] == COMMAND.identifier)
    for k in range(1, 4000):
        data = bytes([0, last[1] & 0xF0 | (last[1] + k) % 16, *last[2:]])
        rows.append((at + k * 2_000_000, COMMAND.identifier, with_currents(data, lambda *_: 1000)))
    late = [violation for violation in judged(rows) if "without any input" in violation.value]
    assert 8.1 < late[0].time_s < 8.4  # 5 s, the ramp, and a few cycles


def set_back(rows, at_ns, by_ns):
    return [(at - by_ns if at >= at_ns else at, can_id, data) for at, can_id, data in rows]


def test_a_clock_that_is_set_back_breaks_no_rule_and_hides_none(sound):
    hour = 3_600_000_000_000
    assert judged(set_back(sound, round(3e9), hour)) == []
    velocity = next(frame for frame in BUS.inputs if frame.name == "RelativeVelocity")
    deaf = [row for row in sound if row[1] != velocity.identifier or row[0] < 4e9]
    found = judged(set_back(deaf, round(4.01e9), hour))
    assert rules(found) == {"timeout"}
    assert 4.05 < found[0].time_s + 3600 < 4.2
    spoilt_after = set_back(spoilt(sound, 2000, SEEDED["slew"]), round(3e9), hour)
    assert rules(judged(spoilt_after)) == {"slew"}


def test_without_a_configuration_the_range_is_the_databases():
    assert default_limits(BUS).current_max_a == {}
    assert default_limits(BUS).cycle_s == 0.002


def test_the_shipped_limits_hold_unless_others_are_given(tmp_path, capsys, sound):
    bad = write(tmp_path / "bad.log", candump(spoilt(sound, 2000, SEEDED["slew"])))
    assert main(["judge", str(bad)]) == 1
    assert " slew: " in capsys.readouterr().out
    assert main(["judge", str(bad), "--slew", "1e6"]) == 0


def test_a_remote_frame_with_the_commands_identifier_is_caught(sound):
    rows = spoilt(sound, 50, lambda row: [row, (row[0] + 1000, row[1] | 1 << 30, b"")])
    assert rules(judged(rows)) == {"length"}


def test_exit_status_and_lines(tmp_path, capsys, sound):
    good = write(tmp_path / "good.log", candump(sound))
    bad = write(tmp_path / "bad.log", candump(spoilt(sound, 2000, SEEDED["range"])))
    empty = write(tmp_path / "empty.log", ["", "nothing"])
    arguments = ["--config", str(CONFIG), "--dbc", str(DBC)]
    assert main(["judge", str(good), *arguments]) == 0
    assert "no rule broken" in capsys.readouterr().out
    assert main(["judge", str(bad), *arguments]) == 1
    line = capsys.readouterr().out.splitlines()[0]
    assert line.startswith("1700000004.000000 Cur_FR range: 3.002 A, limit 0 to 3 A")
    assert main(["judge", str(empty), *arguments]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert main(["judge", str(tmp_path / "none.log"), *arguments]) == 2
    assert main(["judge", str(bad), *arguments, "--json", "-"]) == 1
    verdict = json.loads(capsys.readouterr().out)
    assert set(verdict["by_rule"]) == set(RULES)
    assert verdict["by_rule"]["range"] == 1
    assert not verdict["clean"]


def test_an_error_frame_is_no_frame(tmp_path, sound):
    lines = candump(sound)
    bus_off = (
        "(1700000001.000000) vcan0 20000100#0000000000000000"  # its low bits are the command's identifier
    )
    log = write(tmp_path / "bus.log", [bus_off, *lines])
    assert main(["judge", str(log), "--config", str(CONFIG), "--quiet"]) == 0


def test_other_formats_are_judged_alike(tmp_path, sound):
    import can  # noqa: PLC0415  # it takes a second

    log = tmp_path / "bus.blf"
    with can.BLFWriter(str(log)) as writer:
        for at, can_id, data in spoilt(sound, 2000, SEEDED["crc"]):
            writer(
                can.Message(
                    timestamp=1.7e9 + at / 1e9, arbitration_id=can_id, data=data, is_extended_id=False
                )
            )
    assert main(["judge", str(log), "--config", str(CONFIG), "--quiet"]) == 1


def test_the_judge_loads_nothing_of_the_controller():
    program = (
        "import sys, mrctl.judge.judge, mrctl.judge.limits, mrctl.judge.logs\n"
        "print([m for m in sys.modules if m.startswith('mrctl.') and not m.startswith('mrctl.judge')])"
    )
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=root
    )
    assert done.stdout.strip() == "[]"


def test_a_bus_is_watched_as_it_goes(capsys, sound):
    import can  # noqa: PLC0415  # it takes a second

    channel = "judge-test"

    def drive():
        time.sleep(0.3)
        with can.Bus(interface="virtual", channel=channel) as bus:
            for _, can_id, data in spoilt(sound, 20, SEEDED["crc"])[:200]:
                bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))
                time.sleep(0.0005)

    driver = threading.Thread(target=drive)
    driver.start()
    arguments = ["--driver", "virtual", "--duration", "1.5", "--config", str(CONFIG), "--late-cycles", "100"]
    status = main(["judge", "--interface", channel, *arguments])
    driver.join()
    out = capsys.readouterr().out
    assert status == 1
    assert "CurrentCommand crc: " in out
    assert "CurrentCommand cycle: " in out  # they end before the watching does


def test_an_interface_that_is_not_there_is_one_line(capsys):
    assert main(["judge", "--interface", "can99", "--duration", "0.1"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
