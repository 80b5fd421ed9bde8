"""The compiled build: from the same files, the same bytes."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mrctl.runtime.compiled import COMPILED

ROOT = Path(__file__).resolve().parents[2]
MISSING = [name for name in ("mypyc", "setuptools") if importlib.util.find_spec(name) is None]
if shutil.which("cc") is None and shutil.which("gcc") is None:
    MISSING.append("a C compiler")


def output(program, package_root, *arguments):
    """What a program prints with the package at this root: (standard output, standard error)."""
    environment = {**os.environ, "PYTHONPATH": str(package_root)}
    done = subprocess.run(
        [sys.executable, *map(str, (program, *arguments))],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        cwd=package_root,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout, done.stderr


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A copy of the package with the machine code beside its files."""
    place = tmp_path_factory.mktemp("compiled")
    output(ROOT / "hatch_build.py", ROOT, place)
    for folder in ("mrctl", "config", "dbc"):
        shutil.copytree(
            ROOT / folder, place / folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__")
        )
    return place


@pytest.mark.skipif(bool(MISSING), reason=f"missing: {', '.join(MISSING)}")
def test_under_every_law_map_and_effect_the_compiled_tick_sends_the_same_bytes(compiled):
    program = ROOT / "tests" / "replay" / "every_kind.py"
    interpreted_bytes, said = output(program, ROOT, "--ticks", 2000)
    assert "interpreted" in said
    compiled_bytes, said = output(program, compiled, "--ticks", 2000)
    assert ", compiled" in said
    assert interpreted_bytes.count("\n") > 30
    assert compiled_bytes == interpreted_bytes


@pytest.mark.skipif(bool(MISSING), reason=f"missing: {', '.join(MISSING)}")
def test_the_compiled_build_passes_the_tests_of_the_tick_and_of_replays(compiled):
    """Those of the receiver, of the golden runs, of faults and of log formats, in a process of their own."""
    names = [
        "runtime/test_receiver.py",
        "runtime/test_golden.py",
        "runtime/test_tick.py",
        "replay/test_logs.py",
    ]
    tests = ROOT / "tests"
    output(
        "-m",
        compiled,
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-c",
        "/dev/null",
        "--rootdir",
        compiled,
        "-o",
        f"pythonpath={tests}",
        *(tests / name for name in names),
    )


@pytest.mark.skipif(COMPILED, reason="this is a compiled build")
def test_a_plain_build_has_no_machine_code():
    assert not list((ROOT / "mrctl").rglob("*.so"))
