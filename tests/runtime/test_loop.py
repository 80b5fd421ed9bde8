"""The loop on a clock of the test's: an absolute schedule, late ticks counted and skipped."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrctl.can.ports import PortCounters
from mrctl.runtime.histogram import Histogram
from mrctl.runtime.loop import Loop

PERIOD_NS = 2_000_000


class Lateness(Histogram):
    """Keeps every time, through the ends of seconds."""

    __slots__ = ("times_ns",)

    def __init__(self):
        super().__init__()
        self.times_ns = []

    def add(self, time_ns):
        self.times_ns.append(time_ns)
        super().add(time_ns)


class FakeTick:
    def __init__(self):
        self.periods = []

    def step(self, _frames, periods, _figures):
        self.periods.append(periods)
        return [(1, bytes(8))]


class FakePort:
    def __init__(self, *, accept=True):
        self.accept = accept
        self.counters = PortCounters()
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


class PolledClock(FakeClock):
    """Time passes while it is looked at, and every sleep is noted."""

    def __init__(self, look_ns, oversleep):
        super().__init__()
        self.look_ns = look_ns
        self.oversleep = list(oversleep)
        self.slept_until = []

    def __call__(self):
        self.now += self.look_ns
        return self.now

    def sleep(self, seconds):
        assert seconds > 0.0
        super().sleep(seconds)
        self.slept_until.append(self.now)


@given(
    poll_us=st.floats(0.0, 1000.0),
    look_ns=st.integers(100, 5000),
    oversleep=st.lists(st.integers(0, 3 * PERIOD_NS) | st.integers(0, 200_000), max_size=30),
)
def test_polling_never_starts_a_tick_early_nor_polls_for_longer_than_it_may(poll_us, look_ns, oversleep):
    clock = PolledClock(look_ns, oversleep)
    poll_ns = round(1e3 * poll_us)
    started, polled = [], []

    class Tick(FakeTick):
        def step(self, *given):
            started.append(clock.now)
            polled.append(clock.now - clock.slept_until[-1])
            return super().step(*given)

    late = Lateness()
    tick = Tick()
    loop = Loop(tick, FakePort(), 500.0, poll_us=poll_us, lateness=late, clock_ns=clock, sleep_s=clock.sleep)
    loop.run(lambda: loop.ticks >= 40)
    first_due = look_ns + PERIOD_NS
    assert all(now >= first_due + k * PERIOD_NS for k, now in enumerate(started))
    assert all(t >= 0 for t in late.times_ns)
    # And the looks at the clock from which the sleep was reckoned, and that ended it.
    assert max(polled) <= poll_ns + 3 * look_ns
    assert loop.ticks + loop.skipped == (started[-1] - first_due) // PERIOD_NS + 1


def test_a_loop_that_wakes_within_its_polling_is_on_time():
    clock = PolledClock(10, [50_000] * 100)
    late = Lateness()
    loop = Loop(
        FakeTick(), FakePort(), 500.0, poll_us=60.0, lateness=late, clock_ns=clock, sleep_s=clock.sleep
    )
    loop.run(lambda: loop.ticks >= 100)
    assert max(late.times_ns) <= 10
    clock = PolledClock(10, [50_000] * 100)
    late = Lateness()
    loop = Loop(FakeTick(), FakePort(), 500.0, lateness=late, clock_ns=clock, sleep_s=clock.sleep)
    loop.run(lambda: loop.ticks >= 100)
    assert min(late.times_ns) >= 50_000


def test_frames_that_the_bus_does_not_take_are_counted():
    loop, _, _ = run(7, port=FakePort(accept=False))
    assert loop.unsent == 7


def test_a_tick_that_takes_longer_than_a_period_is_counted():
    class SlowTick(FakeTick):
        def step(self, frames, periods, figures):
            CLOCK.now += 100_000 if len(self.periods) != 5 else 2 * PERIOD_NS + 1
            return super().step(frames, periods, figures)

    CLOCK.__init__()
    tick, port = SlowTick(), FakePort()
    loop = Loop(tick, port, 500.0, clock_ns=CLOCK, sleep_s=CLOCK.sleep)
    port.counters.dropped = 7
    loop.run(lambda: loop.ticks >= 500)
    assert (loop.long_ticks, loop.skipped) == (1, 1)
    figures = loop.figures
    assert (figures.long_ticks, figures.skipped, figures.dropped) == (1, 1, 7)
    assert figures.duration_p50_us == pytest.approx(100.0, rel=1 / 16)
    assert figures.duration_max_us == pytest.approx(4000.0, rel=0.001)
    assert figures.lateness_max_us == pytest.approx(2000.0, rel=0.001)
    assert loop.lateness.count == loop.duration.count == 500


@given(st.lists(st.integers(-1000, 10**12), min_size=1, max_size=300), st.floats(0.01, 1.0))
def test_a_percentile_is_right_to_a_sixteenth(times, fraction):
    histogram = Histogram()
    for time_ns in times:
        histogram.add(time_ns)
    exact_us = max(sorted(times)[math.ceil(fraction * len(times)) - 1], 0) / 1e3
    (found_us,) = histogram.quantiles_us([fraction])
    assert exact_us <= found_us <= exact_us * (1 + 1 / 16) + 1.1
    assert histogram.max_us == max(0, *times) / 1e3


def test_histograms_add_up_and_forget():
    one, other, both = Histogram(), Histogram(), Histogram()
    assert one.quantiles_us([0.5, 0.99]) == [0.0, 0.0]
    for k in range(100):
        (one if k % 3 else other).add(k * 7000)
        both.add(k * 7000)
    one.merge(other)
    fractions = [0.1, 0.5, 0.99, 0.999]
    assert one.quantiles_us(fractions) == both.quantiles_us(fractions)
    assert (one.count, one.max_us) == (100, 693.0)
    one.clear()
    assert (one.count, one.max_us) == (0, 0.0)
