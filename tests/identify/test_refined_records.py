"""Records refined to the rate of the simulation: what lies between two samples was never measured."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrctl.discover.refit import HELD_OUT_SHARE, split
from mrctl.identify.joint import JointModel
from mrctl.identify.records import records_of
from mrctl.identify.start import layout_for, start_values

sys.path.insert(0, str(Path(__file__).parent))
from virtual import Bench, protocol, random_damper

FINER = 3


@pytest.fixture(scope="module")
def campaign():
    return protocol("several frequencies", Bench(random_damper(5), np.random.default_rng(5)))


def test_only_what_was_measured_counts(campaign):
    record = records_of(campaign.runs)[3].refined(FINER)
    between = np.arange(len(record)) % FINER != 0
    spoilt = replace(record, force_n=np.where(between, record.force_n + 500.0, record.force_n))
    plain, other = (JointModel(layout_for([record], 3), [r]) for r in (record, spoilt))
    theta = start_values(plain)
    assert other.cost(theta) == plain.cost(theta) > 0.0
    assert other.rmse_n(theta) == plain.rmse_n(theta)
    (ours, rows), (theirs, _) = next(iter(plain.jacobians(theta))), next(iter(other.jacobians(theta)))
    assert np.array_equal(ours, theirs)
    assert rows.values.shape[1] == ours.size <= len(record) // FINER


def test_a_record_is_cut_where_a_sample_was_measured(campaign):
    first = replace(campaign, runs=campaign.runs[:1])
    measured = records_of(first.runs)
    parts = split(first, [r.refined(FINER) for r in measured])
    (training,), (held_out,) = parts.training, parts.held_out
    assert len(training) % FINER == 0
    assert len(held_out) / len(training) == pytest.approx(1.0 / (HELD_OUT_SHARE - 1), rel=0.01)
    picked = np.concatenate([training.force_n[::FINER], held_out.force_n[::FINER]])
    assert picked == pytest.approx(measured[0].force_n)
