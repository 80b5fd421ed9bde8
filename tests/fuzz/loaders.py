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
from pathlib import Path

from mrctl.calibration import Calibration, load_calibration
from mrctl.config import Config, load_config
from mrctl.errors import InputError
from mrctl.model.static import force_range
from mrctl.model.static_inverse import StaticInverter
from mrctl.runtime.build import plan_of
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
    for temperature in (t.temperature_c[0], t.temperature_c[-1], rng.uniform(-60.0, 200.0)):
        inverter = StaticInverter(t, damper.current_max_a, temperature)
        velocity = rng.choice(t.velocity_m_s)
        shape = t.shape[t.velocity_m_s.index(velocity)]
        if abs(shape) < 1e-9:
            continue
        low, high = sorted(force_range(velocity, temperature, t, damper.current_max_a), key=abs)
        wish = low + rng.random() * (high - low)
        current, _, _ = inverter.invert(wish, shape, False)
        if not (math.isfinite(current) and 0.0 <= current <= damper.current_max_a):
            raise BrokenError(f"current {current} for {wish} N at {velocity} m/s, {temperature} degC")
        if t.off_below_a < t.on_above_a:  # where h switches, forces in the gap have no current
            back = force_range(velocity, temperature, t, current)[1]
            if not abs(back - wish) <= 1e-6 * (1.0 + abs(high)):
                raise BrokenError(f"{wish} N comes back as {back} N at {velocity} m/s, {temperature} degC")


def judge_config(config: Config) -> None:
    """An accepted configuration makes a tick that commands what is in range and within slew."""
    tick = Tick(plan_of(config))
    before = [0.0] * len(tick.corners)
    for _ in range(20):
        tick.step([])
        for k, (corner, name) in enumerate(zip(tick.corners, config.dampers, strict=True)):
            damper = config.calibrations[name].damper
            step = damper.current_slew_a_s / config.loop.rate_hz + 1e-9
            if not (
                0.0 <= corner.current_a <= damper.current_max_a and abs(corner.current_a - before[k]) <= step
            ):
                raise BrokenError(f"{name} commands {corner.current_a} A after {before[k]} A")
            before[k] = corner.current_a


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
        try:
            if name == "calibration.yaml":
                judge_calibration(load_calibration(file), self.rng)
            else:
                judge_config(load_config(file))
        except InputError as error:
            new = False
            for problem in error.problems:
                if "\n" in str(problem) or not problem.what:
                    raise BrokenError(
                        f"a problem of more than one line, or none: {str(problem)!r}"
                    ) from error
                kind = re.sub(r"`[^`]*`|'[^']*'|\d+(\.\d+)?", "*", problem.what)[:60]
                new = new or kind not in self.heard
                self.heard[kind] += 1
            if new and len(self.corpus) < CORPUS_MAX and len(error.problems) < 4:
                self.corpus.append((name, self.text))
        else:
            self.accepted += 1
            if len(self.corpus) < CORPUS_MAX and self.rng.random() < 0.05:
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
