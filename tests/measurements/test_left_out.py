"""Runs kept out of every fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrctl.errors import InputError
from mrctl.measurements.left_out import part
from mrctl.measurements.run import Campaign, Run

N = 50


def run(name: str, force: float = 1.0) -> Run:
    zeros = np.zeros(N)
    return Run(
        name, Path(name), np.arange(N) / 500.0, zeros, zeros, zeros, np.full(N, force), zeros, zeros, 500.0
    )


@pytest.fixture
def campaign() -> Campaign:
    return Campaign(Path("c"), tuple(run(n) for n in ("1Hz_0A.csv", "5Hz_0A.csv", "5Hz_1A.csv")), "0" * 64)


def test_the_runs_whose_names_fit_the_pattern_are_left_out(campaign: Campaign) -> None:
    kept, out = part(campaign, "5Hz*")
    assert [r.name for r in kept.runs] == ["1Hz_0A.csv"]
    assert [r.name for r in out.runs] == ["5Hz_0A.csv", "5Hz_1A.csv"]


def test_without_a_pattern_nothing_is_left_out(campaign: Campaign) -> None:
    kept, out = part(campaign, None)
    assert kept.runs == campaign.runs
    assert not out.runs


@pytest.mark.parametrize(
    ("pattern", "said"), [("7Hz*", "no run has such a name"), ("*.csv", "none is left to fit")]
)
def test_a_pattern_that_leaves_nothing_on_one_side_is_refused(
    campaign: Campaign, pattern: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        part(campaign, pattern)


def test_a_run_without_a_force_cannot_be_compared_with(campaign: Campaign) -> None:
    silent = replace(campaign, runs=(*campaign.runs[:2], run("5Hz_2A.csv", np.nan)))
    with pytest.raises(InputError, match=r"5Hz_2A\.csv has no force"):
        part(silent, "5Hz*")
