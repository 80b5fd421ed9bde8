"""The benchmarks of the loop: they run, agree with what they are held against, and say what they lack."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from mrctl.bench import lateness
from mrctl.bench.c_tick import measure
from mrctl.cli.main import main
from mrctl.config import load_config
from mrctl.runtime import realtime
from mrctl.share_path import share_file


@pytest.mark.skipif(shutil.which("cc") is None and shutil.which("gcc") is None, reason="no C compiler")
def test_the_tick_in_c_commands_the_same_and_is_far_cheaper():
    cost = measure(load_config(share_file("config/vehicle.yaml")), 4000)
    assert cost.difference_a <= 0.002
    assert cost.c_us < cost.python_us / 5


def test_without_a_compiler_or_cyclictest_one_line_says_the_mend(monkeypatch, capsys):
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    for what, mend in (("c-tick", "apt-get install gcc"), ("lateness", "apt-get install rt-tests")):
        assert main(["bench", what]) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("error: ")
        assert mend in line


def test_lateness_is_that_of_loop_and_cyclictest_in_turn(monkeypatch, tmp_path, capsys):
    fake = tmp_path / "cyclictest"
    fake.write_text(
        "#!/bin/sh\nfor word; do case $word in --histfile=*) file=${word#--histfile=};; esac; done\n"
        "printf '# Histogram\\n000010 000098\\n000020 000001\\n000300 000001\\n"
        "# Histogram Overflows: 00000\\n' >$file\n"
    )
    fake.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda _name: str(fake))
    monkeypatch.setattr(lateness, "_fifo_is_granted", lambda: False)
    assert main(["bench", "lateness", "--seconds", "1", "--json", "-"]) == 0
    late = json.loads(capsys.readouterr().out)["lateness_us"]
    ours, theirs = late
    assert late[theirs] == {"p50": 10, "p99": 20, "p99.9": 300, "max": 300}
    assert theirs == "cyclictest, no real-time priority"
    assert ours.startswith("mrctl loop, no real-time priority")  # and what else this machine refuses
    assert 0 <= late[ours]["p50"] < 10_000


def test_what_the_loop_was_refused_stands_beside_its_lateness(monkeypatch):
    monkeypatch.setattr(lateness, "cyclictest", lambda: "cyclictest")
    monkeypatch.setattr(lateness, "_fifo_is_granted", lambda: False)
    monkeypatch.setattr(lateness, "_cyclictest_block", lambda *_words, **_more: {10: 99, 20: 1})
    monkeypatch.setattr(realtime, "_LATENCY_DEVICE", Path("/nowhere/cpu_dma_latency"))
    monkeypatch.setattr(realtime, "_SLEEP_STATES", Path("/"))
    monkeypatch.setattr(realtime, "_lock_memory", lambda: "all")
    ours, _ = lateness.measure(load_config(share_file("config/vehicle.yaml")), 0.2)
    assert ours == "mrctl loop, no real-time priority, without cpu_awake"
