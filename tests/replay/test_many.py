"""Many logs: the same results as one by one, whatever runs them; a broken one stops nobody."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from replay.recording import CONFIG, candump, live, write

from mrctl.cli.main import main
from mrctl.config import load_config
from mrctl.replay.run import replay

ENDS = {"realtime_factor", "log"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three logs, two of them of one name, and one that is broken."""
    folder = tmp_path_factory.mktemp("logs")
    for k, name in enumerate(["a/bus.log", "b/bus.log", "c.log"]):
        (folder / name).parent.mkdir(exist_ok=True)
        write(folder / name, candump(live(600 + 100 * k, seed=k, faults=True)[0]))
    (folder / "broken.blf").write_bytes(b"LOGG" + bytes(100))
    return folder


def logs(folder):
    return [str(folder / name) for name in ("a/bus.log", "broken.blf", "b/bus.log", "c.log")]


@pytest.mark.parametrize("how", [["--jobs", "2"], ["--fleet", "--jobs", "2"]])
def test_side_by_side_is_as_one_by_one(folder, tmp_path, capsys, how):
    out, result = tmp_path / "out", tmp_path / "result.json"
    arguments = ["-c", str(CONFIG), "-o", str(out), "--json", str(result), "--quiet"]
    assert main(["replay", *logs(folder), *arguments, *how]) == 0
    error = [text for text in capsys.readouterr().err.splitlines() if text.startswith("error: ")]
    assert len(error) == 1
    assert "broken.blf" in error[0]
    figures = json.loads(result.read_text())
    assert figures["broken"] == 1
    assert [Path(one["log"]).name for one in figures["logs"]] == ["bus.log", "broken.blf", "bus.log", "c.log"]
    config, total = load_config(CONFIG), 0
    for log, one, name in zip(logs(folder), figures["logs"], ("bus", "", "bus-2", "c"), strict=True):
        if "error" in one:
            continue
        alone = replay(Path(log), config, out=tmp_path / "alone.log").figures
        assert {key: value for key, value in one.items() if key not in ENDS} == {
            key: value for key, value in alone.items() if key not in ENDS
        }
        assert (out / f"{name}.log").read_bytes() == (tmp_path / "alone.log").read_bytes()
        total += alone["ticks"]
    assert figures["ticks"] == total


def test_only_broken_logs_are_unusable_input(folder, capsys):
    broken = str(folder / "broken.blf")
    assert main(["replay", broken, broken, "-c", str(CONFIG), "--jobs", "1", "--quiet"]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_a_scheduler_that_is_not_there_is_said_in_one_line(folder, capsys):
    log = str(folder / "c.log")
    assert main(["replay", log, "-c", str(CONFIG), "--scheduler", "nowhere", "--quiet"]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_a_report_is_one_file_that_needs_nothing_else(folder, tmp_path):
    report = tmp_path / "replay.html"
    log = str(folder / "c.log")
    assert main(["replay", log, "-c", str(CONFIG), "--report", str(report), "--quiet"]) == 0
    html = report.read_text(encoding="utf-8")
    for word in ("front_left", "rear_right", "Force (N)", "Current (A)", "State", "Rejected", "crc"):
        assert word in html
    assert "http://" not in html.replace("http://www.w3.org/2000/svg", "")
    assert "<script" not in html


def test_a_report_does_not_change_what_is_sent(folder, tmp_path):
    log, plain, drawn = str(folder / "c.log"), tmp_path / "plain.log", tmp_path / "drawn.log"
    main(["replay", log, "-c", str(CONFIG), "-o", str(plain), "--quiet"])
    report = ["--report", str(tmp_path / "replay.html")]
    main(["replay", log, "-c", str(CONFIG), "-o", str(drawn), *report, "--quiet"])
    assert plain.read_bytes() == drawn.read_bytes()
