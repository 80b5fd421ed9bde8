"""`mrctl bench model`: both sides give the same force, and each task has its ratio."""

from __future__ import annotations

import json

import pytest

from mrctl.cli.main import main


def test_both_sides_give_the_same_force_and_mrctl_is_the_quicker_by_sample(tmp_path):
    path = tmp_path / "model.json"
    assert main(["bench", "model", "--json", str(path)]) == 0
    cost = json.loads(path.read_text())["model"]
    assert cost["largest_n"] > 100.0
    assert cost["difference_n"] == pytest.approx(0.0, abs=1e-6 * cost["largest_n"])
    assert len(cost["seconds_per_sample"]) == 3
    for name, side in cost["seconds_per_sample"].items():
        assert side["mrctl"] < side["peer"] or name == "forward, a whole run"
