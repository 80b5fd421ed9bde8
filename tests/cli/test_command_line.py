"""The command line: help, exit status, one line an error, and the commands that need no bus."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.cli import discover as discovering
from mrctl.cli.main import COMMANDS, main
from mrctl.errors import FILES_TOLD, Problem, lines_of
from mrctl.model.filters import FilterError
from mrctl.share_path import share_file

CALIBRATION = str(share_file("config/calibration.yaml"))
RATE_HZ = 1000.0


def write_csv(path, **columns):
    names = list(columns)
    rows = zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True)
    path.write_text("\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]) + "\n")
    return str(path)


def read_csv(path):
    with Path(path).open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def motion(seconds=2.0):
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return time, 0.381 * np.cos(2.0 * np.pi * 2.387 * time)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_with_an_example(command, capsys):
    with pytest.raises(SystemExit) as end:
        main([command, "--help"])
    assert end.value.code == 0
    assert f"mrctl {command}" in capsys.readouterr().out.split("example", 1)[1]


@pytest.mark.parametrize(
    "argv",
    [
        ["check", "no-such-file.yaml"],
        ["run", "-c", "no-such-file.yaml"],
        ["predict", "no-such-file.yaml", "x.csv", "-o", "y.csv"],
        ["invert", CALIBRATION, "no-such-run.csv", "-o", "y.csv"],
    ],
)
def test_a_missing_file_is_one_line_and_status_2(argv, capsys):
    assert main(argv) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("error: no-such")


def test_an_unknown_command_is_status_2(capsys):
    with pytest.raises(SystemExit) as end:
        main(["fly"])
    assert end.value.code == 2
    assert "fly" in capsys.readouterr().err


def test_the_shipped_files_are_sound(capsys):
    files = [
        str(share_file(f"config/{name}.yaml")) for name in ("calibration", "vehicle", "vehicle_fd", "bench")
    ]
    assert main(["check", *files, str(share_file("dbc/mrctl.dbc"))]) == 0
    assert "error" not in capsys.readouterr().err


def test_invert_finds_the_current_that_predict_was_given(tmp_path, capsys):
    """The paper's figure for inverse then forward is 3.5 % of the peak force."""
    time, velocity = motion()
    current = 1.8 + np.sin(2.0 * np.pi * 0.6 * time)
    run = write_csv(
        tmp_path / "run.csv",
        time_s=time,
        velocity_m_s=velocity,
        current_A=current,
        temperature_C=np.full_like(time, 60.0),
    )
    predicted, wished, commanded, achieved = (str(tmp_path / f"{n}.csv") for n in "abcd")
    assert main(["predict", CALIBRATION, run, "-o", predicted]) == 0
    wish = read_csv(predicted)["force_model_N"]
    columns = {"velocity_m_s": velocity, "temperature_C": np.full_like(time, 60.0)}
    write_csv(tmp_path / "b.csv", time_s=time, **columns, force_N=wish)
    assert main(["invert", CALIBRATION, wished, "-o", commanded]) == 0
    found = read_csv(commanded)["current_command_A"]
    assert abs(np.mean(found - current)) < 0.1
    write_csv(tmp_path / "e.csv", time_s=time, **columns, current_A=found)
    assert main(["predict", CALIBRATION, str(tmp_path / "e.csv"), "-o", achieved]) == 0
    force = read_csv(achieved)["force_model_N"]
    assert 100.0 * np.sqrt(np.mean((force - wish) ** 2)) / np.max(np.abs(wish)) < 1.0
    assert "Traceback" not in capsys.readouterr().err


def test_predict_warns_outside_the_calibrations_range(tmp_path, capsys):
    time, velocity = motion(0.5)
    run = write_csv(
        tmp_path / "hot.csv",
        time_s=time,
        velocity_m_s=3.0 * velocity,
        current_A=np.ones_like(time),
        temperature_C=np.full_like(time, 120.0),
    )
    assert main(["predict", CALIBRATION, run, "-o", str(tmp_path / "out.csv")]) == 0
    warnings = capsys.readouterr().err
    assert "temperature lies outside" in warnings
    assert "velocity lies outside" in warnings


def test_bench_prints_json(capsys):
    assert main(["bench", "tick", "--ticks", "50", "--json", "-"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["tick_us"]["mrctl"]["p50"] > 0.0


def test_the_daemon_loads_no_desk_library():
    """Neither at import nor while it runs: everything up to the last frame on a virtual bus."""
    code = """
import sys
from mrctl.cli.main import main
status = main(["run", "-c", sys.argv[1], "--interface", "virtual", "--duration", "0.3"])
desk = {"scipy", "numba", "matplotlib", "pandas", "asammdf"} & set(sys.modules)
print(status, sorted(desk))
"""
    result = subprocess.run(
        [sys.executable, "-c", code, str(share_file("config/vehicle.yaml"))],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.stdout.split("\n")[-2] == "0 []", result.stderr


def test_what_discover_fits_to_compare_with_is_a_part_of_its_progress(tmp_path, monkeypatch, capsys):
    time, velocity = motion()
    still = 0.0 * time
    for name, force_n in (("kept", 900.0), ("left", 700.0)):
        columns = {"velocity_m_s": velocity, "current_A": still + 1.0, "temperature_C": still + 40.0}
        write_csv(
            tmp_path / f"{name}.csv", time_s=time, **columns, force_N=force_n * np.tanh(20.0 * velocity)
        )
    shown = []

    class Bar(discovering.Progress):
        def update(self, done, note=""):
            shown.append((done, note))

        def __exit__(self, *_):
            shown.append("closed")

    def identify(campaign, report):
        assert [run.name for run in campaign.runs] == ["kept.csv"]
        report(4, 4, "identified")
        return SimpleNamespace(damper=object())

    def discover(_, report):
        report(0.0, "begun")
        report(1.0, "found")
        raise FilterError("cannot go on")

    for name, stand_in in (("Progress", Bar), ("identify_best", identify), ("discover", discover)):
        monkeypatch.setattr(discovering, name, stand_in)
    words = ["discover", str(tmp_path), "-o", str(tmp_path / "x.yaml"), "--leave-out", "left*"]
    assert main(words) == 2
    assert "cannot go on; measure at 500 Hz or faster" in capsys.readouterr().err
    share = discovering.IDENTIFY_SHARE
    assert shown == [(share, "identified"), (share, "begun"), (1.0, "found"), "closed"]


def test_what_many_files_have_wrong_alike_is_said_once_and_in_order():
    alike = [Problem(f"{k}.csv", 1, "a column is missing", "add it") for k in range(FILES_TOLD + 1)]
    other = Problem("1.csv", 7, "no number", "mend it")
    lines = lines_of([alike[0], other, *alike[1:]])
    assert lines == [
        f"{alike[0]} (the same in {FILES_TOLD} more files, the last of them {FILES_TOLD}.csv)",
        str(other),
    ]
    few = [alike[0], other, *alike[1:-1]]
    assert lines_of(few) == [str(problem) for problem in few]
    assert lines_of([other] * (FILES_TOLD + 1)) == [str(other)] * (FILES_TOLD + 1)  # of one file
