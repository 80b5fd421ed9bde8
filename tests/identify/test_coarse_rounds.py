"""The first rounds of a fit go on less data: what that leaves out must be more of the same."""

from __future__ import annotations

import numpy as np

from mrctl.identify.best import ENOUGH_SAMPLES, coarser, enough
from mrctl.identify.joint import WEIGHING_RATE_HZ
from mrctl.identify.records import Record

SECONDS = 3.0 * ENOUGH_SAMPLES / WEIGHING_RATE_HZ


def _record(velocity, current=1.0, temperature=40.0, rate_hz=WEIGHING_RATE_HZ):
    zeros = np.zeros(velocity.size)
    return Record(0, rate_hz, velocity, zeros + current, zeros + temperature, zeros, zeros, zeros)


def _time(rate_hz=WEIGHING_RATE_HZ):
    return np.arange(int(SECONDS * rate_hz)) / rate_hz


def test_a_record_that_goes_on_as_it_began_is_cut():
    t = _time()
    (cut,) = enough([_record(0.3 * np.sin(15.0 * t))])
    assert len(cut) == ENOUGH_SAMPLES
    assert np.array_equal(cut.velocity_m_s, 0.3 * np.sin(15.0 * t[: len(cut)]))


def test_one_that_goes_on_to_more_is_kept():
    t = _time()
    motion = 0.3 * np.sin(15.0 * t)
    for record in (
        _record(motion * t / t[-1]),
        _record(motion, np.where(t > 0.8 * t[-1], 2.0, 1.0)),
        _record(motion, 1.0, 30.0 + 20.0 * t / t[-1]),
    ):
        assert enough([record])[0] is record


def test_few_samples_are_all_kept():
    record = _record(0.3 * np.sin(15.0 * _time())[: ENOUGH_SAMPLES // 2])
    assert enough([record])[0] is record


def test_fast_records_are_compared_at_the_weighing_rate_and_refined_ones_are_left():
    fast = _record(np.sin(15.0 * _time(2000.0)), rate_hz=2000.0)
    assert coarser(fast).rate_hz == WEIGHING_RATE_HZ
    refined = _record(np.sin(15.0 * _time(250.0)), rate_hz=250.0).refined(4)
    assert coarser(refined) is refined
