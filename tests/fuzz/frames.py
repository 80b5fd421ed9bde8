"""Fuzzed frames through the tick: whatever arrives, every command is finite, in range and within slew.

    python tests/fuzz/frames.py --frames 10000000 --seed 1

Frames are valid, mutated, random, replayed, remote, error frames and of wrong length, in changing mixtures,
so that the tick passes through all its states. Commands are judged here from their raw bits and the DBC's
figures alone: CRC as the AUTOSAR text has it, counter, range, slew. Exit status 1 at the first violation.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from runtime.bench import DAMPER, LIMP_A, RATE_HZ, ROLES, RULES, SPECS, Sender, plan

from mrctl.judge.frames import read_dbc
from mrctl.judge.judge import Judge as BusJudge
from mrctl.judge.limits import Limits
from mrctl.runtime.tick import Tick
from mrctl.share_path import share_file

DBC = read_dbc(share_file("dbc/mrctl.dbc"))
COMMAND_ID = 256
COMMAND_DATA_IDS = bytes.fromhex("118E9609BB243CA3059A821DAF3028B7")
MILLIAMPERES_MAX = 3000
STEP_MAX = round(DAMPER.current_slew_a_s / RATE_HZ * 1000)
EXCUSED_S = 0.2 + 0.05  # plan().off_ramp_s, and some ticks
KINDS = ("valid", "mutated", "random", "replayed", "remote", "error", "length", "nothing")


class Judge:
    """Holds the commands to the rules, from their bits."""

    def __init__(self):
        self.before = (0, 0, 0, 0)
        self.counter = None
        self.commands = 0

    def see(self, frames):
        for can_id, data in frames:
            if can_id != COMMAND_ID:
                continue
            word = int.from_bytes(data, "little")
            raw = tuple(word >> start & 0x1FFF for start in (12, 25, 38, 51))
            counter = word >> 8 & 0xF
            assert len(data) == 8, f"{len(data)} bytes"
            assert data[0] == crc_bit_by_bit(data[1:] + COMMAND_DATA_IDS[counter : counter + 1]), "CRC"
            assert self.counter is None or counter == (self.counter + 1) % 16, "counter"
            assert max(raw) <= MILLIAMPERES_MAX, f"out of range: {raw}"
            assert all(abs(a - b) <= STEP_MAX for a, b in zip(raw, self.before, strict=True)), (
                f"slew: {self.before} to {raw}"
            )
            self.before, self.counter = raw, counter
            self.commands += 1


def bus_judge():
    """`mrctl judge` with the limits of this plan; lateness is the fuzzing's own doing."""
    bus = DBC
    names = [signal.name for signal in bus.command.signals]
    velocity = RULES["relative_velocity"]
    inputs = {f"RelVel_{name.partition('_')[2]}": (velocity.minimum, velocity.maximum) for name in names}
    limits = Limits(
        cycle_s=1.0 / RATE_HZ,
        current_max_a=dict.fromkeys(names, DAMPER.current_max_a),
        slew_a_s=dict.fromkeys(names, DAMPER.current_slew_a_s),
        safe_after={
            name: (signal, velocity.limp_after_s) for name, signal in zip(names, inputs, strict=True)
        },
        input_range=inputs,
        limp_a=LIMP_A,
        late_cycles=math.inf,
        mean_tolerance=math.inf,
    )
    return BusJudge(bus, limits)


class Bus:
    """The frames of the bus in the order of time, before both judges."""

    def __init__(self):
        self.judge, self.second = Judge(), bus_judge()
        self.now_s = self.excused_until_s = 0.0

    def step(self, tick, batch, periods=1):
        # Skipped periods are no time to the second judge: a controller that sleeps cannot keep its time-outs,
        # and when it wakes on a bus that was silent meanwhile, it has its ramp to 0 A.
        if periods > 1:
            self.excused_until_s = self.now_s + EXCUSED_S
        self.now_s += 1.0 / RATE_HZ
        for can_id, data in batch:
            if can_id != COMMAND_ID:  # somebody else's command is broken by its being there
                self.see(self.now_s - 1e-4, can_id, data)
        out = tick.step(batch, periods=periods)
        self.judge.see(out)
        for can_id, data in out:
            self.see(self.now_s, can_id, data)

    def see(self, time_s, can_id, data):
        found = self.second.see(time_s, can_id, data)
        if time_s < self.excused_until_s:
            found = [violation for violation in found if violation.rule != "timeout"]
        assert not found, str(found[0])


_CRC_CACHE = []
for _byte in range(256):
    _value = _byte
    for _ in range(8):
        _value = (_value << 1) ^ 0x12F if _value & 0x80 else _value << 1
    _CRC_CACHE.append(_value & 0xFF)


def crc_bit_by_bit(data):
    """CRC-8H2F of the AUTOSAR text; the inner eight shifts are done once for each byte value, above."""
    crc = 0xFF
    for byte in data:
        crc = _CRC_CACHE[crc ^ byte]
    return crc ^ 0xFF


class Source:
    """Frames of every kind, their mixture changing every few hundred ticks."""

    def __init__(self, seed):
        self.rng = random.Random(seed)
        self.sender = Sender()
        self.old = []
        self.names = list(ROLES)
        self.ids = [SPECS[name].linux_id for name in ROLES]
        self.weights = [1] * len(KINDS)
        self.sent = Counter()
        self.wild = 0.0
        self.levels = {"RelativeVelocity": 0.1, "BodyVelocity": 0.1, "CaseTemperature": 50.0}

    def change_mixture(self):
        rng = self.rng
        self.weights = [rng.choice((0, 0, 1, 5)) for _ in KINDS]
        self.weights[0] = rng.choice((0, 5, 50, 500))
        self.wild = rng.choice((0.0, 0.0, 0.0, 0.1, 0.5))
        if not any(self.weights):
            self.weights[0] = 1

    def valid(self):
        rng = self.rng
        name = rng.choice(self.names)
        scale = {"RelativeVelocity": 1.0, "BodyVelocity": 1.0, "CaseTemperature": 60.0}[name]
        if rng.random() < self.wild:
            level = rng.uniform(-4.0 * scale, 4.0 * scale)
            return self.sender.frame(name, [rng.choice((level, 0.0, float("nan"))) for _ in range(4)])
        walked = self.levels[name] + rng.gauss(0.0, 0.03 if name != "CaseTemperature" else 0.01)
        self.levels[name] = min(max(walked, -scale), scale)
        return self.sender.frame(name, [self.levels[name]] * 4)

    def frame(self):  # noqa: PLR0911  # one return for each kind
        rng = self.rng
        kind = rng.choices(KINDS, self.weights)[0]
        self.sent[kind] += 1
        if kind == "valid":
            frame = self.valid()
            self.old.append(frame)
            if len(self.old) > 64:
                self.old.pop(rng.randrange(64))
            return frame
        if kind == "mutated":
            can_id, data = self.valid()
            flipped = bytearray(data)
            for _ in range(rng.randrange(1, 4)):
                flipped[rng.randrange(8)] ^= 1 << rng.randrange(8)
            return can_id, bytes(flipped)
        if kind == "replayed" and self.old:
            return rng.choice(self.old)
        if kind == "remote":
            return rng.choice(self.ids) | 0x40000000, b""
        if kind == "error":
            return 0x20000000 | rng.getrandbits(9), rng.randbytes(8)
        if kind == "length":
            return rng.choice(self.ids), rng.randbytes(rng.choice((0, 1, 2, 7, 9, 12, 64)))
        return rng.choice((*self.ids, rng.getrandbits(11), rng.getrandbits(29) | 0x80000000)), rng.randbytes(
            8
        )


def run(frames: int, seed: int, *, progress: bool = False) -> tuple[Source, Judge, Tick, Counter]:
    """Send `frames` frames; raises AssertionError at the first command that breaks a rule."""
    source, bus, tick = Source(seed), Bus(), Tick(plan())
    judge = bus.judge
    rng = source.rng
    seen = Counter()
    sent, started, ticks = 0, time.monotonic(), 0
    while sent < frames:
        if ticks % 400 == 0:
            source.change_mixture()
            if rng.random() < 0.02:  # nobody on the bus for longer than it takes to go OFF
                for _ in range(int(6 * RATE_HZ)):
                    bus.step(tick, [])
        count = rng.choice((0, 1, 2, 3, 3, 3, 4, 8)) if ticks % 100 else 200
        batch = [source.frame() for _ in range(count)]
        bus.step(tick, batch, 1 if rng.random() < 0.999 else rng.choice((2, 3, 60, 5000)))
        sent += count
        ticks += 1
        for corner in tick.corners:
            seen[corner.state.name] += 1
        tick.changes.clear()
        if progress and ticks % 20000 == 0:
            rate = sent / (time.monotonic() - started)
            print(
                f"\r{sent:>11,} of {frames:,} frames, {rate:,.0f}/s, {(frames - sent) / rate:,.0f} s to go",
                end="",
                file=sys.stderr,
                flush=True,
            )
    return source, judge, tick, seen


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=10_000_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    source, judge, tick, seen = run(args.frames, args.seed, progress=True)
    print(f"\n{source.sent.total():,} frames: {dict(source.sent)}")
    print(f"refused: {dict(tick.rejected)}, foreign: {tick.foreign:,}")
    print(f"damper states over the ticks: {dict(seen)}")
    print(f"{judge.commands:,} commands, none out of range, beyond slew, or with a wrong CRC or counter")
    return 0


if __name__ == "__main__":
    sys.exit(main())
