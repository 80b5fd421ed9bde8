"""What the daemon says: once a minute its statistics, each second what was rejected, a state once for all."""

from __future__ import annotations

from runtime.bench import Sender
from runtime.faults import config

from mrctl.can.ports import LinkEvent, PortCounters
from mrctl.runtime.build import plan_of
from mrctl.runtime.loop import Loop
from mrctl.runtime.tell import Teller
from mrctl.runtime.tick import Tick

PERIOD_NS = 2_000_000


class FakeLog:
    def __init__(self):
        self.lines = []

    def info(self, event, **fields):
        self.lines.append((event, fields))

    warning = info

    def of(self, event):
        return [fields for name, fields in self.lines if name == event]


class FakeNotifier:
    def __init__(self):
        self.told = []

    def tell(self, *lines):
        self.told += lines


class FakePort:
    """Good frames, but a broken one every second; every other second one frame is not taken."""

    def __init__(self):
        self.counters = PortCounters()
        self.sender = Sender()
        self.n = 0
        self.events = []

    def receive(self):
        self.n += 1
        frames = self.sender.all(velocity=0.1 * (-1) ** self.n, body=0.1 * (-1) ** self.n)
        if self.n % 500 == 0:
            frames.append((0x111, bytes(8)))
        return frames

    def send(self, _can_id, _data):
        return self.n % 1000 != 0

    def take_events(self):
        events, self.events = self.events, []
        return events


class Clock:
    def __init__(self):
        self.now = 0

    def __call__(self):
        self.now += 20_000  # each look takes its time
        return self.now

    def sleep(self, seconds):
        self.now += round(seconds * 1e9) + 50_000


def told(seconds):
    log, notifier, port, clock = FakeLog(), FakeNotifier(), FakePort(), Clock()
    tick = Tick(plan_of(config()))
    loop = Loop(tick, port, 500.0, clock_ns=clock, sleep_s=clock.sleep)
    teller = Teller(config(), tick, loop, port, notifier, log)
    loop._after_tick = teller.after_tick
    port.events = [LinkEvent("link_down", "can0 is down")]
    loop.run(lambda: loop.ticks >= seconds * 500)
    return log, notifier


def test_statistics_come_once_a_minute_with_all_figures():
    log, _ = told(61)
    (first,) = log.of("statistics")
    assert first["ticks"] + first["skipped"] == 30_000
    assert 50 <= first["lateness_p50_us"] <= first["lateness_p999_us"] <= first["lateness_max_us"] <= 100
    assert 15 <= first["duration_p50_us"] <= first["duration_max_us"] <= 30
    assert first["rejected"] == {"crc": 60}
    assert first["unsent"] > 0
    assert set(first["states"].values()) == {"ACTIVE"}
    assert {"long_ticks", "dropped", "stale", "link_down"} <= set(first)


def test_what_was_rejected_is_said_each_second_and_a_state_once_for_all_dampers():
    log, notifier = told(21)
    assert log.of("rejected frames") == [{"crc": 1}] * 21
    (state,) = log.of("state")
    assert state["after"] == "ACTIVE"
    assert state["dampers"] == list(config().dampers)
    assert log.of("link_down") == [{"detail": "can0 is down"}]
    status = [line for line in notifier.told if line.startswith("STATUS=")]
    assert len(status) == 2
    assert "front_left ACTIVE" in status[0]
