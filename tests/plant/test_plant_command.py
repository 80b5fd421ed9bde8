"""`mrctl plant` as a user runs it: a process that ends cleanly, and says what happened."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from mrctl.share_path import share_file


@pytest.fixture
def config(tmp_path):
    """vehicle.yaml on a bus that every machine has."""
    path = Path(share_file("config/vehicle.yaml"))
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    content["bus"] |= {"interface": "virtual", "channel": "plant_test"}
    content["database"] = str(path.parent.parent / "dbc" / "mrctl.dbc")
    content["calibration"] = str(path.parent / "calibration.yaml")
    file = tmp_path / "vehicle.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return file


def command(config, *options):
    return [sys.executable, "-m", "mrctl", "plant", "-c", str(config), *options]


def test_run_ends_by_itself_with_a_summary(config):
    done = subprocess.run(
        command(config, "--duration", "1", "--temperature", "60", "--road", "B", "--noise", "--json", "-"),
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    summary = json.loads(done.stdout)
    assert summary["frames"] > 100  # 1010 where nothing else runs
    assert summary["commands"] == 0
    assert set(summary["dampers"]) == {"front_left", "front_right", "rear_left", "rear_right"}
    assert summary["dampers"]["front_left"]["temperature_c"] == pytest.approx(60.0, abs=1.0)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signal_ends_it_cleanly(config, tmp_path, number):
    summary = tmp_path / "summary.json"
    with subprocess.Popen(
        command(config, "--json", str(summary)), stderr=subprocess.PIPE, text=True
    ) as process:
        assert "driving" in process.stderr.readline()
        process.send_signal(number)
        _, log = process.communicate(timeout=30)
    assert process.returncode == 0
    assert "stopped" in log
    assert "Traceback" not in log
    assert "timeouts" in json.loads(summary.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--temperature", "900"), "--temperature: 900.0 will not do; "),
        (("--speed", "-3"), "--speed: -3.0 will not do; "),
        (("--road", "Z"), "invalid choice"),
    ],
)
def test_unusable_option_is_told_in_one_line(config, options, words):
    done = subprocess.run(command(config, *options), capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert words in done.stderr.splitlines()[-1]
