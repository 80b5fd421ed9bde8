"""`mrctl bench lms`: both sides in one run, the same coefficients, and the ratio of their times."""

from __future__ import annotations

import json

import pytest

from mrctl.cli.main import main


@pytest.fixture(scope="module")
def cost(tmp_path_factory):
    path = tmp_path_factory.mktemp("lms") / "lms.json"
    assert main(["bench", "lms", "--json", str(path)]) == 0
    return json.loads(path.read_text())["lms"]


def test_both_sides_come_to_the_same_coefficients(cost):
    assert cost["largest"] > 1e-3
    assert cost["difference"] <= 1e-9


def test_a_pass_is_at_least_twenty_times_faster_than_padasips(cost):
    assert cost["times_faster"] == pytest.approx(cost["padasip_pass_s"] / cost["pass_s"])
    assert cost["times_faster"] >= 20.0
    assert cost["padasip_passes_s"] >= 20.0 * cost["passes_s"]
