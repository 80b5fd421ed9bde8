"""The loop on a clock of the test's: an absolute schedule, late ticks counted and skipped."""

from __future__ import annotations

from itertools import pairwise

import pytest

from mrctl.runtime.lateness import Lateness
from mrctl.runtime.loop import Loop

PERIOD_NS = 2_000_000


class FakeTick:
    def __init__(self):
        self.periods = []

    def step(self, _frames, periods, _figures):
        self.periods.append(periods)
        return [(1, bytes(8))]


class FakePort:
    def __init__(self, *, accept=True):
        self.accept = accept
        self.sent_at = []

    def receive(self):
        return []

    def send(self, _can_id, _data):
        self.sent_at.append(CLOCK.now)
        return self.accept


class FakeClock:
    def __init__(self):
        self.now = 0
        self.oversleep = []  # ns added to the sleeps, one after another

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += round(seconds * 1e9) + (self.oversleep.pop(0) if self.oversleep else 0)


CLOCK = FakeClock()


def run(ticks, oversleep=(), port=None):
    CLOCK.__init__()
    CLOCK.oversleep = list(oversleep)
    tick, port = FakeTick(), port or FakePort()
    loop = Loop(tick, port, 500.0, clock_ns=CLOCK, sleep_s=CLOCK.sleep)
    loop.run(lambda: loop.ticks >= ticks)
    return loop, tick, port


def test_ticks_keep_an_absolute_schedule():
    _, _, port = run(100, oversleep=[300_000] * 100)
    assert [t - 300_000 for t in port.sent_at] == [PERIOD_NS * (k + 1) for k in range(100)]


def test_a_late_tick_is_counted_and_skipped_without_a_burst():
    loop, tick, port = run(10, oversleep=[0, 0, 7_100_000])
    assert loop.skipped == 3
    assert tick.periods == [1, 1, 4, 1, 1, 1, 1, 1, 1, 1]
    gaps = [b - a for a, b in pairwise(port.sent_at)]
    assert min(gaps) >= PERIOD_NS - 1_100_000
    assert gaps.count(PERIOD_NS) >= 7


@pytest.mark.parametrize("oversleep", [[], [5_000_000], [1_999_999] * 50, [2_000_000] * 50, [0, 900_000_000]])
def test_ticks_and_skips_add_up_to_the_periods_elapsed(oversleep):
    loop, tick, _ = run(60, oversleep)
    assert loop.ticks + loop.skipped == sum(tick.periods) == CLOCK.now // PERIOD_NS


def test_frames_that_the_bus_does_not_take_are_counted():
    loop, _, _ = run(7, port=FakePort(accept=False))
    assert loop.unsent == 7


def test_lateness_percentiles():
    lateness = Lateness()
    assert lateness.percentiles_us() == (0.0, 0.0, 0.0)
    for k in range(100):
        lateness.add(k * 1000)
    p50, p99, largest = lateness.percentiles_us()
    assert 49.0 <= p50 <= 53.0
    assert 98.0 <= p99 <= 102.0
    assert largest == 99.0
    lateness.add(5_000_000)
    assert lateness.percentiles_us()[2] == 5000.0
