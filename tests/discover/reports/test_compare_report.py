"""The report of a comparison as people see it."""

from __future__ import annotations

import pytest
from discover.campaigns import CALIBRATION, grid, with_effect

from mrctl.calibration import load_calibration
from mrctl.discover.compare import compare
from mrctl.discover.reports.compare_report import write_report


@pytest.fixture(scope="module")
def report(tmp_path_factory, damper):
    data = grid(
        with_effect(damper, "gas_spring", preload_n=0.0, stiffness_n_m=12000.0, progression_per_m=0.0)
    )
    path = tmp_path_factory.mktemp("compare") / "compare.html"
    write_report(compare(damper, data), load_calibration(CALIBRATION), data, path, "mrctl compare")
    return path


def test_forty_runs_fit_in_three_megabytes(report):
    assert report.stat().st_size < 3_000_000


@pytest.mark.parametrize("width", [1200, 375])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_the_report_fits_the_screen_without_errors_or_requests(chromium, report, width, dark):
    with chromium.open(report, width=width, dark=dark) as view:
        assert view.errors == []
        assert view.requests == []
        assert view.overflowing() == []
        assert view.colliding_texts() == []
        heads = view.evaluate("[...document.querySelectorAll('h2')].map(h => h.textContent)")
    assert heads == ["How good", "Where it fails", "Measured and modelled", "What is left"]
