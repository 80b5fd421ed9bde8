"""Runs at any sample rate stand on the published method's clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrctl.identify.paper.options import PaperOptions
from mrctl.identify.paper.prepare import prepare
from mrctl.measurements import Campaign
from mrctl.plant.dyno.campaign import Bench
from mrctl.verify.signals import signals_of


@pytest.mark.parametrize("rate_hz", [1000.0, 2000.0])
def test_every_signal_is_as_long_as_the_record_and_says_the_same(rate_hz):
    bench = Bench(seed=3)
    drives = [drive for drive in bench.drives("paper", rate_hz) if drive.name.endswith("132F")]
    runs = tuple(bench.measure(drive).run for drive in drives)
    campaign = Campaign(Path("dyno"), runs, "0" * 64)
    signals = signals_of(campaign, prepare(campaign, PaperOptions()))
    assert len(signals) == 4
    for s, run in zip(signals, runs, strict=True):
        for values in (s.velocity_m_s, s.current_a, s.force_n, s.displacement_m, s.wish_n):
            assert values.size == s.record.force_n.size
        assert s.dt_s == 1.0 / 2000.0
        at = slice(2000, 6000, round(2000.0 / rate_hz))
        assert s.force_n[at] == pytest.approx(run.force_n[round(rate_hz) : round(3 * rate_hz)])
        # The wish keeps the force and loses the noise: 3 N white, of which a tenth is below 100 Hz.
        assert np.std(s.record.cut(s.wish_n - s.force_n)) < 4.5


def test_a_forces_error_is_in_percent_of_the_largest_wanted_one():
    drives = [drive for drive in Bench().drives("paper") if drive.name == "2A_132F"]
    campaign = Campaign(Path("dyno"), (Bench().measure(drives[0]).run,), "0" * 64)
    (s,) = signals_of(campaign, prepare(campaign, PaperOptions()))
    largest = np.max(np.abs(s.record.cut(s.force_n)))
    assert s.percent(s.force_n + 10.0) == pytest.approx(1000.0 / largest)
    assert s.percent(s.wish_n, s.wish_n) == 0.0
