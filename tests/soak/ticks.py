"""The loop for millions of ticks: no garbage collection, no major fault, no growth, every period counted.

    PYTHONPATH=.:tests python tests/soak/ticks.py                    3.6 million ticks, two hours at 500 Hz
    PYTHONPATH=.:tests python tests/soak/ticks.py --realtime 600     ten minutes on the real clock too

The real loop, tick and port of config/vehicle.yaml, on a bus without a kernel and a clock that runs as fast
as the ticks do. Now and then a wake-up is late by up to some periods, frames are missing or broken, so that
ticks are skipped and the states are passed through. Exit status 1 at the first thing that is not as said.
"""

from __future__ import annotations

import argparse
import gc
import math
import random
import resource
import sys
import time
from pathlib import Path

from mrctl.bench.wire import INTERFACE, Wire, WireBus
from mrctl.can.codec import make_encoder
from mrctl.can.socketcan_port import SocketCanPort
from mrctl.config import load_config
from mrctl.runtime import realtime
from mrctl.runtime.build import input_signals, plan_of
from mrctl.runtime.loop import Loop
from mrctl.runtime.tick import Tick
from mrctl.share_path import share_file

WARM_UP_TICKS = 200_000
GROWTH_MAX_KIB = 256  # the kernel counts the resident set in batches of pages
CYCLE_TICKS = 8000  # a whole number of all counters' rounds
TEMPERATURE_EVERY = 50


class Clock:
    """Monotonic time that only sleeping and ticks advance; wakes late now and then."""

    def __init__(self, seed):
        self.now = 0
        self.rng = random.Random(seed)

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        chance = self.rng.random()
        late_ns = 60_000 if chance > 0.001 else round(self.rng.expovariate(1 / 3e6))
        if chance < 1e-6:
            late_ns = 400_000_000
        self.now += round(seconds * 1e9) + late_ns


def frames_of(config):
    """Good frames for a cycle of ticks, which joins on to itself."""
    rate_hz = config.loop.rate_hz
    out = [[] for _ in range(CYCLE_TICKS)]
    for spec, users in input_signals(config):
        encode = make_encoder(spec)
        role = users[0][0][1]
        every = TEMPERATURE_EVERY if role == "temperature" else 1
        for n in range(0, CYCLE_TICKS, every):
            # Whole turns in a cycle, so that nothing jumps where it begins again.
            phase = 2 * math.pi * n / CYCLE_TICKS
            turns = {"relative_velocity": (23, 0.4), "body_velocity": (17, 0.3)}.get(role)
            values = [
                50.0 + k if turns is None else turns[1] * math.sin(turns[0] * phase + k)
                for k in range(len(users))
            ]
            out[n].append((spec.linux_id, encode(values, n // every)))
    assert CYCLE_TICKS / rate_hz > 1
    return out


class Car:
    """Lays the frames of the tick on the wire, some of them missing or broken."""

    def __init__(self, wire, cycle, seed):
        self.wire, self.cycle = wire, cycle
        self.rng = random.Random(seed)
        self.broken_until = 0
        self.missing_until = 0

    def before(self, n):
        if self.rng.random() < 1e-5:
            self.missing_until = n + self.rng.randrange(1, 4000)
        if self.rng.random() < 1e-4:
            self.broken_until = n + self.rng.randrange(1, 30)
        if n < self.missing_until:
            return
        for can_id, data in self.cycle[n % CYCLE_TICKS]:
            self.wire.lay(can_id, data[::-1] if n < self.broken_until else data)


def resident_kib():
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() // 1024


class Soak:
    """Runs the loop and watches the process."""

    def __init__(self, config, ticks, clock, sleep, seed):
        self.ticks = ticks
        self.tick = Tick(plan_of(config))
        wire = Wire(stamped=False)
        self.car = Car(wire, frames_of(config), seed)
        self.port = SocketCanPort(WireBus(wire), INTERFACE, self.tick.wanted_ids)
        self.clock = clock
        self.loop = Loop(
            self.tick, self.port, config.loop.rate_hz, after_tick=self.after, clock_ns=clock, sleep_s=sleep
        )
        self.warm = None
        self.states = set()
        self.shown = time.monotonic()
        self.started = self.shown

    def after(self, ticks):
        self.car.before(ticks + self.loop.skipped)
        if self.tick.changes:
            self.states.update(change.after.name for change in self.tick.changes)
            self.tick.changes.clear()
        self.port.take_events()
        if ticks == min(WARM_UP_TICKS, self.ticks // 4):
            self.warm = self.process()
        if ticks % 10_000 == 0 and sys.stderr.isatty():
            rate = ticks / (time.monotonic() - self.started)
            print(f"\r{ticks:,} ticks, {rate:,.0f}/s", end="", file=sys.stderr)

    def process(self):
        usage = resource.getrusage(resource.RUSAGE_SELF)
        collections = sum(generation["collections"] for generation in gc.get_stats())
        return {"collections": collections, "major_faults": usage.ru_majflt, "resident_kib": resident_kib()}

    def run(self, period_ns):
        begun = self.clock()
        self.loop.run(lambda: self.loop.ticks >= self.ticks)
        end = self.process()
        elapsed = (self.clock() - begun) // period_ns
        accounted = self.loop.ticks + self.loop.skipped
        grown = end["resident_kib"] - self.warm["resident_kib"]
        faults = {
            "garbage collections": end["collections"] - self.warm["collections"],
            "major faults": end["major_faults"] - self.warm["major_faults"],
            "growth beyond the allowance, KiB": max(0, grown - GROWTH_MAX_KIB),
            "periods unaccounted for": elapsed - accounted,
        }
        print(
            f"{self.loop.ticks:,} ticks + {self.loop.skipped:,} skipped = {accounted:,} of {elapsed:,} "
            f"periods; states {sorted(self.states)}; refused {dict(self.tick.rejected)}; grown {grown} KiB "
            f"from {self.warm['resident_kib']:,}; {time.monotonic() - self.started:.0f} s"
        )
        for name, count in faults.items():
            print(f"  {name}: {count}")
        return not any(faults.values())


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--ticks", type=int, default=3_600_000)
    parser.add_argument("--realtime", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    config = load_config(share_file("config/vehicle.yaml"))
    period_ns = round(1e9 / config.loop.rate_hz)
    clock = Clock(args.seed)
    soak = Soak(config, args.ticks, clock, clock.sleep, args.seed)
    print(f"realtime: {realtime.enter(config.realtime)}")
    good = soak.run(period_ns)
    if args.realtime:
        ticks = round(args.realtime * config.loop.rate_hz)
        soak = Soak(config, ticks, time.monotonic_ns, time.sleep, args.seed)
        # Between the last tick and the question how late it is, less than a period passes.
        good = soak.run(period_ns) and good
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
