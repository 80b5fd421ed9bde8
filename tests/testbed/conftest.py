"""Fixtures of the test bed. A bed that does not come up fails every test that needs it, with the mend."""

from __future__ import annotations

import os
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from bed import Bed, Guest, NativeBed, machine_has_can

HERE = Path(__file__).resolve().parent
LEFT_OUT = pytest.StashKey[int]()
EXCUSED = pytest.StashKey[list[str]]()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if os.environ.get("MRCTL_NO_TESTBED") != "1":
        return
    here = [item for item in items if item.path.is_relative_to(HERE)]
    items[:] = [item for item in items if item not in here]
    config.hook.pytest_deselected(items=here)
    config.stash[LEFT_OUT] = len(here)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A test that fails on a drive with an excuse is not a finding: skipped, and said in the summary."""
    report = yield
    drives = [getattr(value, "excuse", "") for value in getattr(item, "funcargs", {}).values()]
    excuse = next(filter(None, drives), "")
    if report.failed and call.when == "call" and excuse:
        report.outcome = "skipped"
        report.longrepr = (str(item.path), item.location[1] or 0, f"Skipped: {excuse}")
    if report.skipped and not hasattr(report, "wasxfail"):
        item.config.stash.setdefault(EXCUSED, []).append(f"{item.name}: {report.longrepr[2]}")
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    for what in config.stash.get(EXCUSED, []):
        terminalreporter.write_line(f"NOT TESTED: {what}", red=True, bold=True)
    count = config.stash.get(LEFT_OUT, 0)
    if count:
        what = f"NOT TESTED: {count} tests on a real SocketCAN and a real systemd (MRCTL_NO_TESTBED=1)"
        terminalreporter.write_line(what, red=True, bold=True)


@pytest.fixture(scope="session")
def guest(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bed]:
    """The one guest of the session, with systemd."""
    bed = Guest(tmp_path_factory.mktemp("guest"))
    yield bed
    bed.close()


@pytest.fixture(scope="session")
def bus(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Bed:
    """Where SocketCAN tests run: this machine if it can have a vcan interface, else the guest."""
    if machine_has_can():
        return NativeBed(tmp_path_factory.mktemp("native"))
    guest: Bed = request.getfixturevalue("guest")
    return guest
