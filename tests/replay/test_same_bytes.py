"""What a replay sends is what the live loop sent, byte for byte."""

from __future__ import annotations

import dataclasses
import random
import subprocess
import sys
from pathlib import Path

import pytest
from replay.recording import (
    ARRIVES_BEFORE_NS,
    CONFIG,
    EPOCH_NS,
    candump,
    first_difference,
    live,
    sent_lines,
    write,
)

from mrctl.can.frames import State
from mrctl.config import load_config
from mrctl.replay.run import Options, replay


def again(tmp_path, lines, options=None, config=None):
    log, out = write(tmp_path / "bus.log", lines), tmp_path / "again.log"
    figures = replay(log, config or load_config(CONFIG), options, out=out).figures
    return figures, out.read_text(encoding="ascii").splitlines()


def payloads(lines, names):
    return [text.split("#")[1] for text in sent_lines(lines, names)]


def test_a_hundred_thousand_ticks_with_faults_are_the_same_to_the_byte(tmp_path):
    rows, tick, _ = live(100_000, faults=True)
    lines = candump(rows)
    figures, out = again(tmp_path, lines)
    assert first_difference(out, sent_lines(lines)) is None  # stamps and health frames too
    assert figures["clock"] == "recorded"
    assert figures["ticks"] == figures["commands"] == figures["compared"]["same_bytes"] == 100_000
    assert figures["differences"] == 0
    assert figures["rejected"] == dict(tick.rejected)
    assert {"crc", "counter", "malformed", "remote_frame", "error_frame"} <= set(figures["rejected"])
    assert {state for spent in figures["states_s"].values() for state in spent} == {
        state.name for state in State
    }


@pytest.mark.parametrize("rate_hz", [1000.0, 2000.0])
def test_other_rates_too(tmp_path, rate_hz):
    config = load_config(CONFIG)
    config = dataclasses.replace(config, loop=config.loop.model_copy(update={"rate_hz": rate_hz}))
    rows, _, _ = live(8000, config=config, faults=True)
    lines = candump(rows)
    # At 2 kHz the first frames come before the first period begins: the bus was open by then.
    figures, out = again(tmp_path, lines, Options(opened_before_s=0.001), config)
    assert first_difference(out, sent_lines(lines)) is None
    assert figures["differences"] == 0


def test_on_the_grid_too_where_the_start_is_known(tmp_path):
    rows, _, _ = live(5000, faults=True)
    lines = candump(rows)
    sent = set(sent_lines(lines))
    mute = [text for text in lines if text not in sent]
    figures, out = again(tmp_path, mute, Options(clock="grid", start_s=EPOCH_NS / 1e9))
    assert figures["clock"] == "grid"
    assert first_difference(out, sent_lines(lines)[: len(out)]) is None
    assert len(out) > 0.99 * len(sent_lines(lines))


def test_ticks_that_the_loop_skipped_are_skipped_again(tmp_path):
    rng = random.Random(3)

    def oversleep():
        return rng.choice((0, 1000, 90_000)) if rng.random() < 0.995 else rng.randrange(2_000_000, 90_000_000)

    rows, _, loop = live(20_000, faults=True, oversleep=oversleep)
    lines = candump(rows)
    figures, out = again(tmp_path, lines)
    assert figures["skipped"] == loop.skipped > 1000
    assert figures["ticks"] == loop.ticks
    names = ["CurrentCommand", "ControllerState"]  # the health frames tell of lateness
    assert first_difference(payloads(out, names), payloads(lines, names)) is None
    assert figures["differences"] == 0


def test_commands_missing_in_the_log_are_no_skipped_ticks(tmp_path):
    rows, _, _ = live(6000)
    lines = candump(rows)
    rng = random.Random(5)
    commands = set(sent_lines(lines, ["CurrentCommand"]))
    ends = min(commands), max(commands)
    kept = [text for text in lines if text not in commands or text in ends or rng.random() < 0.8]
    figures, out = again(tmp_path, kept)
    assert figures["skipped"] == 0
    assert figures["differences"] == 0
    names = ["CurrentCommand"]
    assert first_difference(payloads(out, names), payloads(lines, names)) is None


def test_the_same_log_gives_the_same_bytes_on_a_grid_every_time(tmp_path):
    rows, _, _ = live(3000, faults=True)
    mute = [row for row in rows if row[0] % 2_000_000 == 2_000_000 - ARRIVES_BEFORE_NS]
    first, second = (again(tmp_path, candump(mute)) for _ in range(2))
    assert first_difference(first[1], second[1]) is None
    assert len(first[1]) > 3000


def test_the_million_tick_command_runs():
    program = Path(__file__).with_name("million.py")
    done = subprocess.run(
        [sys.executable, str(program), "--ticks", "3000"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "3,000 ticks" in done.stdout
    assert "no byte differs" in done.stdout
