"""Programs of frames: any bytes are one, so that a fuzzer that only knows bytes can drive the tick.

A byte chooses what comes, its high bits and the bytes after it how; a program that ends in the middle reads
zeros. The first byte chooses the current map.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from fuzz.frames import Bus
from runtime.bench import DAMPER, ROLES, SPECS, Sender, plan

from mrctl.control.laws import LAWS as KINDS
from mrctl.control.maps import make_current_map
from mrctl.runtime.tick import Tick

# With parameters where a map would else be fitted to the damper anew for each program.
MAPS = {
    "inverse": {},
    "linear": {},
    "reader": {"corner_hz": 10.0},
    "liu": {"viscous_length_m": 0.1, "field_force_n": 800.0, "exponent": 0.6},
}
LAWS = tuple(law.name for law in KINDS.values() if law.needs <= set(ROLES.values()))
NAMES = list(ROLES)
IDS = [SPECS[name].linux_id for name in ROLES]
SCALE = {"RelativeVelocity": 1.0, "BodyVelocity": 1.0, "CaseTemperature": 60.0}
OLD_FRAMES = 64
LENGTHS = (0, 1, 2, 7, 9, 12, 48, 64)

GOOD, VALID, MUTATED, RAW, OLD, REMOTE, ERROR, LENGTH, TICK, SKIP, SILENCE, COUNTER = range(12)
SEEDS = (
    bytes([0, GOOD, 63, GOOD, 63]),
    bytes([1, GOOD, 31, SILENCE | 16, 40, GOOD, 63]),
    bytes([2, GOOD, 31, SILENCE | 160, 255, GOOD, 63, GOOD, 63]),
    bytes([3, GOOD, 31, *(k for n in range(20) for k in (VALID, n, 200, 9 * n, TICK)), GOOD, 31]),
    bytes([16, GOOD, 31, *(k for n in range(20) for k in (MUTATED, n, 7 * n, n, TICK)), GOOD, 31]),
    bytes([32, GOOD, 31, OLD, 1, OLD, 2, TICK, RAW, 0, 1, 2, 3, 4, 5, 6, 7, 8, TICK, SKIP, 20, GOOD, 31]),
    bytes([0, GOOD, 31, REMOTE, 1, TICK, ERROR, 1, 2, 3, 4, 5, 6, 7, 8, TICK, LENGTH, 1, 3, TICK, GOOD, 9]),
    bytes([0, GOOD, 31, COUNTER, 0, 3, GOOD, 31, COUNTER, 1, 9, GOOD, 31]),
)


@cache
def plan_of(law: str, current_map: str):
    def make_map(dt_s):
        return make_current_map(current_map, DAMPER, dt_s, MAPS[current_map])

    made = plan(law)
    return replace(made, corners=tuple(replace(corner, make_map=make_map) for corner in made.corners))


class Program:
    """Runs a program before both judges, an AssertionError at the first command that breaks a rule."""

    def __init__(self, data: bytes) -> None:
        self._data = iter(data)
        self._left = len(data)
        self.sender = Sender()
        self.old = [(0, b"")]
        self.batch = []
        self.levels = dict.fromkeys(NAMES, 0.1) | {"CaseTemperature": 50.0}
        self.ticks = self.frames = 0
        first = self.byte()
        law, current_map = LAWS[(first >> 4) % len(LAWS)], list(MAPS)[first % len(MAPS)]
        self.tick = Tick(plan_of(law, current_map))
        self.bus = Bus()

    def byte(self) -> int:
        self._left -= 1
        return next(self._data, 0)

    def run(self, ticks_max: int) -> None:
        """Until the program or so many ticks are over."""
        steps = (self.good, self.valid, self.mutated, self.raw, self.again, self.remote, self.error,
                 self.length, self.end_tick, self.skip, self.silence, self.jump)  # fmt: skip
        while self._left > 0 and self.ticks < ticks_max:
            word = self.byte()
            steps[(word & 15) % len(steps)](word >> 4)
        self.end_tick()

    def lay(self, frame: tuple[int, bytes]) -> None:
        self.batch.append(frame)
        self.frames += 1

    def end_tick(self, _high: int = 0, periods: int = 1) -> None:
        self.bus.step(self.tick, self.batch, periods)
        self.batch = []
        self.ticks += 1
        self.tick.changes.clear()

    def good(self, high: int) -> None:
        """Up to 64 ticks with one good frame of each kind; `high` moves the values from tick to tick."""
        for _ in range(self.byte() % 64 + 1):
            for name in NAMES:
                level = self.levels[name] + (high - 8) * 0.004 * (name != "CaseTemperature")
                self.levels[name] = level if abs(level) < SCALE[name] else -level * 0.99
                self.lay(self.sender.frame(name, [self.levels[name]] * 4))
            self.end_tick()

    def one(self):
        name = NAMES[self.byte() % len(NAMES)]
        scale = 4.0 * SCALE[name]
        value = (int.from_bytes((self.byte(), self.byte()), "big") / 32768.0 - 1.0) * scale
        self.old = [*self.old[-OLD_FRAMES:], self.sender.frame(name, [value, value, -value, value / 2])]
        return self.old[-1]

    def valid(self, high: int) -> None:
        """A frame whose value may be anything; with `high` the value that all four dampers had."""
        if high & 1:
            name = NAMES[self.byte() % len(NAMES)]
            values = [self.levels[name]] * 4
            if high & 2:
                values[high >> 2] = float("nan")
            self.lay(self.sender.frame(name, values))
        else:
            self.lay(self.one())

    def mutated(self, high: int) -> None:
        can_id, data = self.one()
        flipped = int.from_bytes(data, "little")
        for _ in range(high % 4 + 1):
            flipped ^= 1 << self.byte() % 64
        self.lay((can_id, flipped.to_bytes(8, "little")))

    def raw(self, high: int) -> None:
        can_id = (*IDS, 0x80000000 | self.byte() << 8, self.byte())[high % 5]
        self.lay((can_id, bytes(self.byte() for _ in range(8))))

    def again(self, _high: int) -> None:
        self.lay(self.old[self.byte() % len(self.old)])

    def remote(self, high: int) -> None:
        self.lay((IDS[high % len(IDS)] | 0x40000000, b""))

    def error(self, _high: int) -> None:
        self.lay((0x20000000 | self.byte(), bytes(self.byte() for _ in range(8))))

    def length(self, high: int) -> None:
        self.lay((IDS[self.byte() % len(IDS)], bytes([self.byte()]) * LENGTHS[high % len(LENGTHS)]))

    def skip(self, high: int) -> None:
        self.end_tick(periods=1 + self.byte() * (1, 1, 10, 100)[high % 4])

    def silence(self, high: int) -> None:
        for _ in range((self.byte() + 1) * (1 + high)):
            self.end_tick()

    def jump(self, _high: int) -> None:
        """The counter of a frame goes on elsewhere."""
        self.sender._counter[NAMES[self.byte() % len(NAMES)]] += self.byte()
