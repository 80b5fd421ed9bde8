"""Which runs are left out to prove a model on."""

import numpy as np
import pytest
from discover.hidden import bench_of

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.folds import as_warm, held_as_long
from mrctl.discover.fits.refit import HELD_OUT_SHARE, split
from mrctl.measurements.run import Campaign

RATE_HZ = 200.0


def campaign_of(tmp_path, steady_a):
    """Sines at steady currents, and roads on which the current goes through all of them in steps."""
    bench = bench_of(None, 2)
    runs = [
        bench.sine(f"{k}_{current_a:g}A", RATE_HZ, 2.0, 0.02, 6, current_a, 30.0)
        for k, current_a in enumerate(steady_a)
    ]
    t, v = bench.road(RATE_HZ, 6.0)
    levels = np.array(sorted(set(steady_a)))
    stepped_a = levels[(t / 0.5).astype(int) % levels.size]
    runs += [bench.run(f"steps_{k}", t, v, stepped_a, 30.0) for k in range(3)]
    return Campaign(tmp_path, tuple(runs), "0" * 64)


@pytest.mark.parametrize(
    "steady_a",
    [(0.0, 1.0, 1.0, 2.0, 2.0, 3.0), (1.0, 0.0, 2.0, 1.0, 3.0, 2.0), (0.0, 0.0, 1.0, 2.0, 3.0, 3.0)],
)
def test_a_steady_current_is_left_out_only_where_another_run_holds_it(tmp_path, steady_a):
    campaign = campaign_of(tmp_path, steady_a)
    parts = split(campaign, Evidence.of(campaign).full)
    assert 1 <= len(parts.held_out) <= len(campaign.runs) // HELD_OUT_SHARE
    assert all(held_as_long(left_out, parts.training) for left_out in parts.held_out)


def test_where_each_current_is_held_once_runs_are_left_out_all_the_same(tmp_path):
    """What the steps tell of them is enough to predict them."""
    campaign = campaign_of(tmp_path, (0.0, 1.0, 2.0, 3.0))
    parts = split(campaign, Evidence.of(campaign).full)
    assert parts.held_out
    assert parts.begins == [0] * len(parts.held_out)


def campaign_at(tmp_path, runs):
    """Sines, each at a current in A and a temperature in degC."""
    bench = bench_of(None, 2)
    sines = [bench.sine(f"{k}", RATE_HZ, 2.0, 0.02, 6, *conditions) for k, conditions in enumerate(runs)]
    return Campaign(tmp_path, tuple(sines), "0" * 64)


def test_a_warmth_is_left_out_only_where_another_run_has_it_with_a_field_too(tmp_path):
    """That of 2 A at 20 degC is told by none at 0 A, however warm."""
    at = [
        (0.0, 20.0),
        (2.0, 20.0),
        (2.0, 40.0),
        (2.0, 41.0),
        (2.0, 60.0),
        (2.0, 61.0),
        (0.0, 60.0),
        (0.0, 62.0),
    ]
    records = Evidence.of(campaign_at(tmp_path, at)).full
    alone = [n for n, r in enumerate(records) if not as_warm(r, [o for o in records if o is not r])]
    assert alone == [0, 1]
    parts = split(campaign_at(tmp_path, at), records)
    assert parts.held_out
    assert not {"0", "1"} & set(parts.names)
