"""The dampers and the browser that these tests share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from discover.campaigns import shipped
from report.browser import Browser

from mrctl.model.damper import Damper


@pytest.fixture(scope="session")
def damper() -> Damper:
    return shipped()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    with Browser() as running:
        yield running
