"""Fixtures of the test bed. A bed that does not come up fails every test that needs it, with the mend."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from bed import Bed, Guest, NativeBed, machine_has_can

HERE = Path(__file__).resolve().parent
LEFT_OUT = pytest.StashKey[int]()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if os.environ.get("MRCTL_NO_TESTBED") != "1":
        return
    here = [item for item in items if item.path.is_relative_to(HERE)]
    items[:] = [item for item in items if item not in here]
    config.hook.pytest_deselected(items=here)
    config.stash[LEFT_OUT] = len(here)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
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
