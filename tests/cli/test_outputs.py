"""Where commands write: refused before any work, never over an input; names that are hard to print."""

from __future__ import annotations

import argparse
import importlib
import inspect
import json
import os
import subprocess
import sys

import numpy as np
import pytest

from mrctl.calibration import load_calibration
from mrctl.cli import compare, diagnosis
from mrctl.cli.main import main
from mrctl.cli.outputs import write_figures
from mrctl.measurements import load_campaign
from mrctl.model.effects import registry
from mrctl.share_path import share_file

CALIBRATION = share_file("config/calibration.yaml")
COLUMNS = "time_s,displacement_m,velocity_m_s,current_A,temperature_C,force_N"


def write_run(path, current_a=1.0, frequency_hz=2.0, header=COLUMNS):
    time = np.arange(1000) / 500.0
    way = 2.0 * np.pi * frequency_hz
    x, v = 0.02 * np.sin(way * time), 0.02 * way * np.cos(way * time)
    force = (300.0 + 900.0 * current_a) * np.tanh(v / 0.05) + 200.0 * v
    force += np.random.default_rng(1).normal(0.0, 3.0, len(time))
    rows = np.column_stack([time, x, v, np.full_like(time, current_a), np.full_like(time, 40.0), force])
    lines = [header, *(",".join(map(repr, row)) for row in rows.tolist())]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A calibration and a campaign of one run in the current folder."""
    (tmp_path / "damper.yaml").write_bytes(CALIBRATION.read_bytes())
    (tmp_path / "campaign").mkdir()
    write_run(tmp_path / "campaign" / "run.csv")
    (tmp_path / "link.csv").symlink_to("campaign/run.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(capsys, command):
    """The one line that a command line is refused with."""
    assert main(command.split()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: ")
    return line


@pytest.mark.parametrize(
    "command",
    [
        "identify campaign/run.csv -o campaign/run.csv",
        "identify campaign -o link.csv",
        "discover campaign -o a.yaml --json campaign/run.csv",
        "compare damper.yaml campaign --json damper.yaml",
        "compare damper.yaml campaign --report campaign/../campaign/run.csv",
        "diagnose damper.yaml campaign --json campaign/run.csv",
        "extend damper.yaml campaign --effect gas_spring -o campaign/run.csv",
        "extend damper.yaml campaign --effect gas_spring -o new.yaml --json damper.yaml",
        "predict damper.yaml campaign/run.csv -o damper.yaml",
        "predict damper.yaml campaign/run.csv -o campaign/run.csv",
        "invert damper.yaml campaign/run.csv -o link.csv",
        "verify campaign -o campaign/run.csv",
        "dyno --damper damper.yaml -o new --json damper.yaml",
    ],
)
def test_an_input_is_never_replaced(place, capsys, command):
    before = [file.read_bytes() for file in (place / "damper.yaml", place / "campaign" / "run.csv")]
    assert "would replace what is read as" in refused(capsys, command)
    assert before == [file.read_bytes() for file in (place / "damper.yaml", place / "campaign" / "run.csv")]
    assert len(list(place.iterdir())) == 3


def test_a_calibration_may_be_extended_in_its_place(place):
    words = "extend damper.yaml campaign --effect force_offset -o damper.yaml --quiet"
    assert main(words.split()) == 0
    assert [e.name for e in load_calibration(place / "damper.yaml").damper.effects] == ["force_offset"]


@pytest.mark.parametrize("outputs", ["-o x --json x", "-o x --report ./x", "-o y --json x --report x"])
def test_two_outputs_are_two_files(place, capsys, outputs):
    line = refused(capsys, f"extend damper.yaml campaign --effect gas_spring {outputs}")
    assert "name the same file" in line
    assert len(list(place.iterdir())) == 3


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("identify campaign -o no/a.yaml", "no/a.yaml: there is no folder no; make it first: mkdir -p no"),
        ("identify campaign -o a.yaml --json campaign", "campaign: is a folder; name a file in it"),
        ("identify campaign -o a.yaml --report campaign", "campaign: is a folder; name a file in it"),
        ("compare damper.yaml campaign --json no/a.json", "there is no folder no"),
        ("compare damper.yaml campaign --report damper.yaml/a.html", "cannot be written (Not a directory)"),
        ("diagnose damper.yaml campaign --json no/a.json", "there is no folder no"),
        ("extend damper.yaml campaign --effect gas_spring -o no/a.yaml", "there is no folder no"),
        ("discover campaign -o no/a.yaml", "there is no folder no"),
        ("predict damper.yaml campaign/run.csv -o no/a.csv", "there is no folder no"),
        ("invert damper.yaml campaign/run.csv -o campaign", "is a folder"),
        ("verify -o campaign", "is a folder"),
        ("verify --json no/a.json", "there is no folder no"),
        ("dyno -o new --json no/a.json", "there is no folder no"),
        ("compare no.yaml none --json " + 300 * "x", "cannot be written (File name too long)"),
    ],
)
def test_a_place_that_cannot_be_written_is_said_before_any_work(place, capsys, command, said):
    assert said in refused(capsys, command)
    assert len(list(place.iterdir())) == 3


def test_a_report_makes_its_folder_and_a_device_takes_two_outputs(place):
    words = ["compare", "damper.yaml", "campaign", "--json", "/dev/null", "--report", "new/a.html", "--quiet"]
    assert main(words) == 0
    assert (place / "new" / "a.html").stat().st_size
    assert not list(place.rglob("*.part"))


@pytest.mark.parametrize("quiet", [False, True])
@pytest.mark.parametrize("place", [None, "-", "figures.json"])
def test_figures_are_written_where_they_are_asked_for(place, quiet, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    printing = write_figures(argparse.Namespace(json=place, quiet=quiet), {"rmse_n": 1.5})
    assert printing == (not quiet and place != "-")
    written = {"-": capsys.readouterr().out, **{file.name: file.read_text() for file in tmp_path.iterdir()}}
    assert {where: json.loads(text) for where, text in written.items() if text} == (
        {place: {"rmse_n": 1.5}} if place else {}
    )


@pytest.mark.parametrize("command", ["identify", "compare", "diagnose", "extend", "discover"])
def test_figures_are_written_in_one_way(command):
    source = inspect.getsource(importlib.import_module(f"mrctl.cli.{command}"))
    assert "write_figures(" in source
    assert "json.dumps" not in source


def test_a_comparison_takes_its_data_as_a_diagnosis_does():
    assert compare.data_arguments is diagnosis.data_arguments
    assert compare.load_sound is diagnosis.load_sound


@pytest.mark.parametrize("command", [["identify", "", "-o", "a.yaml"], ["compare", "", "x"], ["check", ""]])
def test_an_empty_path_is_not_the_current_folder(place, capsys, command):
    assert main(command) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "is empty" in line
    assert not (place / "a.yaml").exists()


def test_predict_says_which_columns_it_leaves_out(place, capsys):
    write_run(place / "more.csv", header=COLUMNS.replace("displacement_m", "strain"))
    assert main(["predict", "damper.yaml", "more.csv", "-o", "out.csv", "--quiet"]) == 0
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "strain" in line]
    assert line == "warning: more.csv: columns not used: strain; not in out.csv"


def test_names_that_are_not_utf8_go_the_whole_way(tmp_path, capsys):
    folder = tmp_path / os.fsdecode(b"inv\xff")
    folder.mkdir()
    for current, name in ((0.0, b"a\xfe.csv"), (1.0, b"b.csv"), (2.0, b"c\nd.csv")):
        write_run(folder / os.fsdecode(name), current)
    files = [str(tmp_path / name) for name in ("a.yaml", "a.json", "a.html")]
    assert main(["identify", str(folder), "-o", files[0], "--json", files[1], "--report", files[2]]) == 0
    printed = capsys.readouterr()
    assert "a\\xfe.csv" in printed.out
    assert "c\\nd.csv" in printed.out
    names = ["a\\xfe.csv", "b.csv", "c\\nd.csv"]
    assert [run["file"] for run in json.loads((tmp_path / "a.json").read_bytes().decode())["runs"]] == names
    loaded = load_calibration(files[0])
    assert loaded.name == "inv\\xff"
    assert loaded.provenance.source.endswith("inv\\xff")
    assert main(["compare", files[0], str(folder), "--report", files[2], "--quiet"]) == 0
    words = ["--effect", "force_offset", "-o", str(tmp_path / "b.yaml"), "--quiet"]
    assert main(["extend", files[0], str(folder), *words]) == 0
    assert load_calibration(tmp_path / "b.yaml").provenance.source.endswith("inv\\xff")
    assert len(load_campaign(folder).sha256) == 64


def test_a_line_feed_in_a_name_does_not_part_the_line(place, capsys):
    (place / "campaign" / "bad\nname.csv").write_text("")
    assert "bad\\nname.csv: is empty" in refused(capsys, "identify campaign -o a.yaml")


def test_what_removes_and_adds_an_effect_says_both_and_its_report_shows_how(place, capsys):
    for current in (0.0, 2.0):
        write_run(place / "campaign" / f"{current:g}.csv", current)
    words = "extend b.yaml campaign --effect gas_spring --remove force_offset -o c.yaml --report c.html"
    first = ("identify campaign -o a.yaml", "extend a.yaml campaign --effect force_offset -o b.yaml")
    assert [main([*command.split(), "--quiet"]) for command in (*first, words)] == [0, 0, 0]
    assert load_calibration("c.yaml").provenance.history[-1].what == "extend and remove force_offset"
    assert f"mrctl {words}" in (place / "c.html").read_text()
    capsys.readouterr()
    line = refused(capsys, "extend a.yaml campaign --effect gas_sprnig -o d.yaml")
    assert "did you mean gas_spring?" in line


@pytest.mark.parametrize("command", ["compare damper.yaml campaign", "predict bad.yaml link.csv -o a.csv"])
def test_an_effect_that_divides_by_zero_is_one_line(place, capsys, monkeypatch, command):
    assert main(["effects", "--new", "groove", "-o", "groove.py"]) == 0
    source = place / "groove.py"
    monkeypatch.setenv(registry.VARIABLE, str(source))
    registry.forget()
    setting = "effects: [{name: groove, parameters: {coefficient_n_s3_m3: {unit: N*s^3/m^3, value: 5.0}}}]"
    (place / "bad.yaml").write_text(CALIBRATION.read_text().replace("\neffects: []", "\n" + setting))
    source.write_text(source.read_text().replace("return p[0] *", "return p[0] / (p[0] - p[0]) *"))
    registry.forget()
    capsys.readouterr()
    try:
        line = refused(capsys, command + " --quiet")
    finally:
        monkeypatch.delenv(registry.VARIABLE)
        registry.forget()
    assert "groove.py" in line
    assert "division" in line


def shell(command):
    words = f"{sys.executable} -m mrctl {command}"
    return subprocess.run(words, shell=True, capture_output=True, text=True, check=False)  # noqa: S602


@pytest.mark.parametrize("command", ["effects", "compare damper.yaml campaign --quiet --json -"])
def test_a_full_disk_behind_standard_output_is_one_line_and_status_1(place, command):  # noqa: ARG001
    done = shell(f"{command} > /dev/full")
    assert done.returncode == 1
    assert done.stderr.startswith("error: standard output: failed (No space left on device)")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("closed", [">&-", "2>&-"])
def test_a_closed_stream_is_no_failure(place, closed):  # noqa: ARG001
    done = shell(f"compare damper.yaml campaign {closed}")
    assert done.returncode == 0
    assert "Traceback" not in done.stderr + done.stdout
