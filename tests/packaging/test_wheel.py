"""What a user gets: installed into an empty environment, away from the checkout."""

from __future__ import annotations

import json
import subprocess
import sys
import venv
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The bin folder of an environment with mrctl and its own needs only, and an empty folder to work in."""
    root = tmp_path_factory.mktemp("user")
    venv.create(root / "env", with_pip=True)
    python = root / "env" / "bin" / "python"
    subprocess.run(
        [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", REPOSITORY], check=True
    )
    (root / "work").mkdir()
    return python.parent, root / "work"


def run(installed, *words):
    binaries, work = installed
    return subprocess.run(
        [binaries / words[0], *words[1:]], cwd=work, capture_output=True, text=True, check=False
    )


def test_the_demo_runs_from_the_wheel(installed):
    result = run(installed, "mrctl", "demo", "--json", "demo.json", "--quiet")
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    work = installed[1]
    assert "<html" in (work / "demo" / "report.html").read_text()
    figures = json.loads((work / "demo.json").read_text())
    assert figures["error_over_linear_map_ideal_coil"]["85"] < 1.0 / 3.0
    assert figures["bus"]["rest_a"] == 0.0


def test_shipped_files_are_found_and_no_desk_library_came_along(installed):
    code = (
        "import importlib.util as u; from mrctl.share_path import share_file;"
        "print(share_file('config/vehicle.yaml'));"
        "print([n for n in ('scipy', 'numba', 'matplotlib', 'pandas', 'asammdf') if u.find_spec(n)])"
    )
    result = run(installed, "python", "-c", code)
    shipped, desk = result.stdout.splitlines()
    assert str(REPOSITORY) not in shipped
    assert desk == "[]"
    assert run(installed, "mrctl", "check", shipped).returncode == 0


@pytest.mark.parametrize("command", ["predict", "invert", "plant", "effects", "bench"])
def test_light_commands_need_nothing_more(installed, command):
    result = run(installed, "mrctl", command, "--help")
    assert result.returncode == 0, result.stderr


def test_the_version_is_that_of_the_package(installed):
    assert run(installed, "mrctl", "--version").stdout.startswith("mrctl ")
    assert sys.version_info >= (3, 11)
