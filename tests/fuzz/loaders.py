"""Broken calibrations and configurations through their loaders: refused in one line each, or sound.

    PYTHONPATH=.:tests python tests/fuzz/loaders.py --minutes 10 --seed 1

Starts from the shipped files, spoils their text and their values, and keeps what brought a complaint not
heard before for further spoiling. A loader may raise InputError and nothing else; each problem is one line
with the mend. What a loader accepts must work: the inverse finds every force back, and the tick commands what
is finite, in range and within slew. Exit status 1 at the first that does not, its text in loader_fault.yaml.
"""

from __future__ import annotations

import argparse
import math
import random
import re
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from mrctl.calibration import Calibration, load_calibration
from mrctl.can.codec import make_encoder
from mrctl.config import Config, load_config
from mrctl.errors import InputError, Problem
from mrctl.model.damper import Damper
from mrctl.model.static import StaticTables, force_level, force_range
from mrctl.model.static_inverse import StaticInverter
from mrctl.runtime.build import input_signals, plan_of
from mrctl.runtime.tick import Tick
from mrctl.share_path import share_file

SEEDS = ("calibration.yaml", "vehicle.yaml", "bench.yaml", "vehicle_fd.yaml")
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")
NUMBERS = (
    "0", "-1", "1", "1e300", "-1e300", ".nan", ".inf", "-.inf", "1e-300", "99999999999999999999", "0.0",
    "1e-3", "12:30", "on", "null", "''", "[]", "{}", "[1, 2]", "'1.0'", "0x10", "1_000", "2024-01-01",
)  # fmt: skip
TOKENS = ("\t", ":", "- ", "{", "}", "[", "]", "&a", "*a", "!!python/object:os.system", "|", ">", "#",
          "\x00", "\ufeff", "é", "---\n", "...\n", "? ", "<<: *a\n", "'", '"', "%YAML 9.9\n", "\r",
          "\u2028")  # fmt: skip
CORPUS_MAX = 400
# A drive in the middle of what is plausible: mean and swing, by role.
ROLE_VALUES = {"relative_velocity": (0.0, 0.3), "body_velocity": (0.0, 0.3), "temperature": (50.0, 0.0)}


def spoil(rng: random.Random, text: str) -> str:
    """The text after one to four changes."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        text = rng.choice(CHANGES)(rng, text)
    return text[:200_000]


def _number(rng, text):
    found = list(NUMBER.finditer(text))
    if not found:
        return text
    at = rng.choice(found)
    if rng.random() < 0.5:
        new = rng.choice(NUMBERS)
    else:
        try:
            new = repr(float(at.group()) * rng.choice((-1.0, 0.5, 0.9, 1.001, 1.1, 2.0, 10.0, 1e3, 1e-3)))
        except ValueError:
            new = "7"
    return text[: at.start()] + new + text[at.end() :]


def _lines(rng, text):
    lines = text.splitlines(keepends=True)
    if len(lines) < 2:
        return text
    k = rng.randrange(len(lines))
    kind = rng.randrange(5)
    if kind == 0:
        del lines[k]
    elif kind == 1:
        lines.insert(k, lines[rng.randrange(len(lines))])
    elif kind == 2:
        other = rng.randrange(len(lines))
        lines[k], lines[other] = lines[other], lines[k]
    elif kind == 3:
        lines[k] = rng.choice(("  ", " ", "\t")) + lines[k]
    else:
        lines[k] = lines[k].lstrip()
    return "".join(lines)


def _swap_numbers(rng, text):
    found = list(NUMBER.finditer(text))
    if len(found) < 2:
        return text
    k = rng.randrange(len(found) - 1)
    one, other = found[k], found[k + 1]
    return (
        text[: one.start()]
        + other.group()
        + text[one.end() : other.start()]
        + one.group()
        + text[other.end() :]
    )


def _token(rng, text):
    k = rng.randrange(len(text) + 1)
    return text[:k] + rng.choice(TOKENS) + text[k + rng.choice((0, 0, 1, 10)) :]


def _cut(rng, text):
    k = rng.randrange(len(text) + 1)
    return text[:k] if rng.random() < 0.3 else text[:k] + text[k + rng.randrange(1, 200) :]


def _word(rng, text):
    words = list(re.finditer(r"[A-Za-z_]{2,}", text))
    if not words:
        return text
    at, other = rng.choice(words), rng.choice(words)
    return text[: at.start()] + other.group() + text[at.end() :]


CHANGES = (_number, _number, _number, _swap_numbers, _lines, _lines, _token, _cut, _word)


class BrokenError(AssertionError):
    """A loader that did what it must not."""


def judge_calibration(calibration: Calibration, rng: random.Random) -> None:
    """An accepted calibration inverts: a force in reach comes back from the current that is found for it."""
    damper = calibration.damper
    t = damper.static
    judge_tables(t, damper.current_max_a)
    for temperature in (*t.temperature_c, rng.uniform(-60.0, 200.0)):
        inverter = StaticInverter(t, damper.current_max_a, temperature)
        for velocity in rng.choices(t.velocity_m_s, k=4):
            judge_inverse(damper, inverter, velocity, temperature, rng)


def judge_tables(t: StaticTables, current_max_a: float) -> None:
    """What an inverse stands on: finite, every axis and the force over the current rising, h positive."""
    columns = [value for value in t if isinstance(value, tuple)]
    if not all(math.isfinite(x) for column in columns for x in column):
        raise BrokenError("a table is not finite")
    for name in ("current_a", "force_n", "velocity_m_s", "temperature_c", "blend_current_a"):
        if any(low >= high for low, high in pairwise(getattr(t, name))):
            raise BrokenError(f"{name} does not rise: {getattr(t, name)}")
    if not (t.current_a[0] == 0.0 < current_max_a <= t.current_a[-1] and t.force_n[0] > 0.0):
        raise BrokenError(f"f from {t.current_a[0]} to {t.current_a[-1]} A, limit {current_max_a} A")
    if min(*t.h_off, *t.h_on) <= 0.0 or not 0.0 <= t.off_below_a <= t.on_above_a:
        raise BrokenError("h is not positive, or its states overlap")
    if any(v * g < 0.0 or not -1.0 <= g <= 1.0 for v, g in zip(t.velocity_m_s, t.shape, strict=True)):
        raise BrokenError("g has not the velocity's sign, or leaves -1 to 1")
    for temperature in t.temperature_c:  # f h over the current, finer than its corners
        currents = sorted({current_max_a * k / 64 for k in range(65)} | set(t.blend_current_a))
        levels = [force_level(current, temperature, t) for current in currents if current <= current_max_a]
        switches = t.off_below_a == t.on_above_a  # as in the paper: may fall there
        if not switches and any(low >= high for low, high in pairwise(levels)):
            raise BrokenError(f"the force does not rise with the current at {temperature} degC: {levels}")


def judge_inverse(
    damper: Damper, inverter: StaticInverter, velocity: float, temperature: float, rng: random.Random
) -> None:
    """A force that the damper can make at a knot of g comes back from its current, whatever the state."""
    t = damper.static
    shape = t.shape[t.velocity_m_s.index(velocity)]
    low, high = sorted(force_range(velocity, temperature, t, damper.current_max_a), key=abs)
    wish = low + rng.choice((0.0, 1.0, rng.random(), rng.random())) * (high - low)
    for was_on in (False, True):
        current, _, _ = inverter.invert(wish, shape, was_on)
        if not (math.isfinite(current) and 0.0 <= current <= damper.current_max_a):
            raise BrokenError(f"current {current} for {wish} N at {velocity} m/s, {temperature} degC")
        # Where h switches, forces in the gap have no current; where g is next to nothing, any has it.
        if abs(shape) < 1e-9 or t.off_below_a == t.on_above_a:
            continue
        back = force_range(velocity, temperature, t, current)[1]
        if not abs(back - wish) <= 1e-6 * (1.0 + abs(high)):
            raise BrokenError(f"{wish} N comes back as {back} N at {velocity} m/s, {temperature} degC")


def judge_config(config: Config) -> None:
    """An accepted configuration makes a tick that commands what is in range and within slew."""
    tick = Tick(plan_of(config))
    inputs = [(spec, make_encoder(spec), users) for spec, users in input_signals(config)]
    before = [0.0] * len(tick.corners)
    for now in range(60):
        frames = []
        for spec, encode, users in inputs if now >= 10 else ():
            motion = [ROLE_VALUES.get(of_signal[0][1], (0.0, 0.0)) for of_signal in users]
            values = [mean + swing * math.sin(0.2 * now) for mean, swing in motion]
            frames.append((spec.linux_id, encode(values, now)))
        tick.step(frames)
        for k, (corner, name) in enumerate(zip(tick.corners, config.dampers, strict=True)):
            damper = config.calibrations[name].damper
            step = damper.current_slew_a_s / config.loop.rate_hz + 1e-9
            if not (  # not so for NaN
                0.0 <= corner.current_a <= damper.current_max_a and abs(corner.current_a - before[k]) <= step
            ):
                raise BrokenError(f"{name} commands {corner.current_a} A after {before[k]} A")
            before[k] = corner.current_a


def judge_file(file: Path, rng: random.Random, *, calibration: bool) -> Sequence[Problem]:
    """What the loader finds wrong with a file, nothing where it accepts it.

    Raises BrokenError where it says so badly or accepts what does not work, or what it must not raise.
    """
    try:
        if calibration:
            judge_calibration(load_calibration(file), rng)
        else:
            judge_config(load_config(file))
    except InputError as error:
        for problem in error.problems:
            if "\n" in str(problem) or not problem.what:
                raise BrokenError(f"a problem of more than one line, or none: {str(problem)!r}") from error
        return error.problems
    return ()


class Fuzz:
    """The corpus, and what the loaders have said so far."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.rng = random.Random(seed)
        self.folder = folder / "config"
        shutil.copytree(share_file("config/vehicle.yaml").parent, self.folder)
        shutil.copytree(share_file("dbc/mrctl.dbc").parent, folder / "dbc")
        self.corpus = [(name, (self.folder / name).read_text(encoding="utf-8")) for name in SEEDS]
        self.heard: Counter[str] = Counter()
        self.tried = self.accepted = 0
        self.text = ""

    def step(self) -> None:
        """Spoil one text and give it to its loader; raises BrokenError, or what the loader must not raise."""
        known = self.corpus if self.rng.random() < 0.7 else self.corpus[: len(SEEDS)]
        name, text = self.rng.choice(known)
        self.text = spoil(self.rng, text)
        file = self.folder / f"spoilt_{name}"
        file.write_bytes(self.text.encode("utf-8", "surrogatepass"))
        self.tried += 1
        problems = judge_file(file, self.rng, calibration=name == "calibration.yaml")
        new = False
        for problem in problems:
            kind = re.sub(r"`[^`]*`|'[^']*'|\d+(\.\d+)?", "*", problem.what)[:60]
            new = new or kind not in self.heard
            self.heard[kind] += 1
        self.accepted += not problems
        keep = (new and len(problems) < 4) if problems else self.rng.random() < 0.05
        if keep and len(self.corpus) < CORPUS_MAX:
            self.corpus.append((name, self.text))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    ends = time.monotonic() + 60.0 * args.minutes
    with tempfile.TemporaryDirectory() as folder:
        fuzz = Fuzz(Path(folder), args.seed)
        try:
            while time.monotonic() < ends:
                fuzz.step()
        except BaseException:
            Path("loader_fault.yaml").write_bytes(fuzz.text.encode("utf-8", "surrogatepass"))
            print(f"after {fuzz.tried:,} files, seed {args.seed}: see loader_fault.yaml", file=sys.stderr)
            raise
    print(
        f"{fuzz.tried:,} files: {fuzz.accepted:,} accepted, all sound; {len(fuzz.heard)} kinds of complaint"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
