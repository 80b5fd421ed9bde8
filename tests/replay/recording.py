"""The live loop on a clock of the test's, its bus recorded as candump would."""

from __future__ import annotations

import math
import random

from mrctl.can.codec import make_encoder
from mrctl.can.ports import PortCounters
from mrctl.config import load_config
from mrctl.runtime.build import frame_specs, input_signals, plan_of
from mrctl.runtime.loop import Loop
from mrctl.runtime.tick import Tick
from mrctl.share_path import share_file

CONFIG = share_file("config/vehicle.yaml")
CHANNEL = "vcan0"
EPOCH_NS = 1_700_000_000_000_000_000
ARRIVES_BEFORE_NS = 700_000  # of the ticks: when frames come


class Car:
    """Sensor frames for tick n: a rough road, and with `faults` everything that can be wrong with a frame."""

    def __init__(self, config, seed=1, *, faults=False):
        self.rng = random.Random(seed)
        self.faults = faults
        self.rate_hz = config.loop.rate_hz
        self.encoders = [(spec, users, make_encoder(spec)) for spec, users in input_signals(config)]
        self.every = {
            spec.name: max(1, round(self.rate_hz / config.frames.receive[spec.name]))
            for spec, _, _ in self.encoders
        }

    def value(self, user, n):
        corner, role = user
        t = n / self.rate_hz
        if role == "temperature":
            return 30.0 + corner + min(40.0, 0.02 * t)
        if role in {"displacement", "body_acceleration", "force_wish"}:
            size = {"displacement": 0.03, "body_acceleration": 2.0, "force_wish": 900.0}[role]
            return size * math.sin(9.1 * t + corner)
        if role == "body_velocity":
            return 0.3 * math.sin(7.3 * t + corner) + 0.05 * math.sin(31.0 * t)
        return 0.25 * math.sin(9.1 * t + corner) + 0.15 * math.sin(70.0 * t * (1 + 0.1 * corner))

    def frames(self, n):
        out = []
        for spec, users, encode in self.encoders:
            every = self.every[spec.name]
            if n % every == 0:
                values = [self.value(of_signal[0], n) if of_signal else math.nan for of_signal in users]
                out.append((spec.linux_id, encode(values, n // every)))
        return self.spoilt(out, n) if self.faults else out

    def spoilt(self, frames, n):
        rng = self.rng
        off = n % 20_000
        if 15_000 < off < 18_000 or 9000 < off < 9300:  # a cable is off for a while
            return []
        if 5000 < off < 5100:  # one sensor is
            frames = [frame for frame in frames if frame[0] != 273]
        if frames and rng.random() < 0.02:
            can_id, data = rng.choice(frames)
            k = frames.index((can_id, data))
            kind = rng.randrange(6)
            if kind == 0:
                frames.pop(k)
            elif kind == 1:
                frames[k] = can_id, bytes([data[0] ^ 1 << rng.randrange(8), *data[1:]])
            elif kind == 2:
                frames.insert(k, (can_id, data))
            elif kind == 3:
                frames.insert(k, (can_id | 0x40000000, b""))
            elif kind == 4:
                frames[k] = can_id, data[: rng.randrange(8)]
            else:
                frames.insert(k, (0x20000004, bytes([0, 4, 0, 0, 0, 0, 0, 0])))
        return frames


class FakeClock:
    def __init__(self, oversleep):
        self.now, self.oversleep = 0, oversleep

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += round(seconds * 1e9) + self.oversleep()


class RecordingPort:
    """Hands out what has arrived by now, and notes every frame of the bus with its time."""

    def __init__(self, clock, car, period_ns):
        self.counters = PortCounters()
        self.clock, self.car, self.period_ns = clock, car, period_ns
        self.made = 0
        self.rows = []

    def receive(self):
        frames = []
        while self.made * self.period_ns + self.period_ns - ARRIVES_BEFORE_NS <= self.clock.now:
            at = (self.made + 1) * self.period_ns - ARRIVES_BEFORE_NS
            for frame in self.car.frames(self.made):
                frames.append(frame)
                self.rows.append((at, *frame))
            self.made += 1
        return frames

    def send(self, can_id, data):
        self.rows.append((self.clock.now, can_id, data))
        return True


def live(ticks, *, config=None, seed=1, faults=False, oversleep=lambda: 0):
    """Run the live loop; the rows (ns, CAN ID, payload) of its bus, in order, and the tick."""
    config = config or load_config(CONFIG)
    clock = FakeClock(oversleep)
    tick = Tick(plan_of(config))
    period_ns = round(1e9 / config.loop.rate_hz)
    port = RecordingPort(clock, Car(config, seed, faults=faults), period_ns)
    loop = Loop(tick, port, config.loop.rate_hz, clock_ns=clock, sleep_s=clock.sleep)
    loop.run(lambda: loop.ticks >= ticks)
    return port.rows, tick, loop


def candump(rows, channel=CHANNEL, epoch_ns=EPOCH_NS):
    """Rows as the lines of `candump -L`."""
    return [line(at + epoch_ns, can_id, data, channel) for at, can_id, data in rows]


def line(time_ns, can_id, data, channel=CHANNEL):
    seconds, rest = divmod(time_ns // 1000, 1_000_000)
    plain = can_id & 0x1FFFFFFF
    name = f"{can_id:08X}" if can_id & 0x20000000 else f"{plain:08X}" if can_id >> 31 else f"{plain:03X}"
    payload = "R" if can_id & 0x40000000 else data.hex().upper()
    return f"({seconds:010d}.{rest:06d}) {channel} {name}#{payload}"


def write(path, lines):
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


def sent_ids(config=None):
    """The identifiers that the controller sends, as candump writes them."""
    specs = frame_specs(config or load_config(CONFIG))
    return {name: f" {spec.can_id:03X}#" for name, spec in specs.items()}


def sent_lines(lines, names=None):
    """Those of the lines that the controller sent."""
    ids = sent_ids()
    wanted = [ids[name] for name in names or ids]
    return [text for text in lines if any(mark in text for mark in wanted)]


def first_difference(one, other):
    """Where two lists of lines part, or None; pytest's own comparison takes minutes for long lists."""
    for k, (a, b) in enumerate(zip(one, other, strict=False)):
        if a != b:
            return k, a, b
    return None if len(one) == len(other) else ("lengths", len(one), len(other))
