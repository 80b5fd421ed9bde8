"""Spencer's damper in the verification: what its errors are held against."""

from __future__ import annotations

import numpy as np
import pytest

from mrctl.identify.best import identify_best
from mrctl.verify import spencer
from mrctl.verify.spencer import ACCUMULATOR, Trace


def test_errors_are_in_percent_of_the_largest_wanted_force():
    wanted = np.array([0.0, 200.0, -400.0, 100.0])
    trace = Trace(np.arange(4.0), np.zeros(4), wanted, wanted + np.array([4.0, -4.0, 4.0, -8.0]))
    assert trace.percent == pytest.approx([1.0, -1.0, 1.0, -2.0])
    assert trace.peak == pytest.approx(2.0)
    assert trace.rms == pytest.approx(np.sqrt(7.0) / 2.0)


def test_all_voltages_and_speeds_are_measured_and_whole_cycles_kept():
    cases = spencer._cases(1)
    assert len({case.volts for case in cases}) == 6
    assert max(case.speed_m_s for case in cases) == pytest.approx(0.12 * np.pi, rel=1e-3)
    for case in cases:
        seconds = (case.kept.stop - case.kept.start) / case.item.drive.rate_hz
        assert seconds == pytest.approx(5.0 / 2.5, abs=2e-3)


def test_the_published_motion_is_met_within_one_percent_and_four_at_the_spikes():
    cases = spencer._cases(2)
    case = max(cases, key=lambda one: (one.speed_m_s > 0.37, -abs(one.volts - spencer.SHOWN_V)))
    base = identify_best(spencer._campaign([case])).fit
    trace = spencer._trace(spencer._with(base, [case], ACCUMULATOR), case)
    assert trace.rms < 1.0
    assert trace.peak < 4.0
