"""Coverage-guided fuzzing with atheris: what reaches new code is kept and spoilt further.

    pip install atheris
    PYTHONPATH=.:tests python tests/fuzz/guided.py frames --minutes 10
    PYTHONPATH=.:tests python tests/fuzz/guided.py calibration --minutes 10
    PYTHONPATH=.:tests python tests/fuzz/guided.py config --minutes 10

frames: bytes are read as a program of ticks, good and bad frames, silence and skipped periods; the
interpreted tick's commands go before the judges of frames.py, mrctl/judge among them. calibration, config:
valid files are spoilt as in loaders.py, and judged as there. `--corpus FOLDER` keeps what reached new code
for the next time. Exit status 1 at the first violation, its input in guided_TARGET_*.
"""

from __future__ import annotations

import argparse
import math
import mmap
import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from re import Match

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

try:
    import atheris
except ImportError:
    sys.exit("error: atheris is not installed; pip install atheris")

# What is imported here is watched for new code; other libraries are not under test.
with atheris.instrument_imports(include=["mrctl"]):
    from mrctl.calibration import load_calibration
    from mrctl.calibration.render import render_calibration
    from mrctl.model.damper import EffectSetting
    from mrctl.model.effects.registry import effects
    from mrctl.model.static import static_tables
    from mrctl.runtime import build  # noqa: F401  # the tick, and all that it is made from
    from mrctl.share_path import share_file

    EFFECTS = effects()  # imports them, too

from fuzz.loaders import NUMBER, judge_file, spoil
from fuzz.programs import SEEDS, Program

COUNTERS = ("executions", "accepted", "ticks", "frames", "commands")
TICKS_PER_INPUT = 3000
BYTES_MAX = {"frames": 4096, "calibration": 20_000, "config": 20_000}
_DONE = re.compile(r"#(\d+)\s+(INITED|DONE)\s+cov: (\d+) ft: (\d+) corp: (\d+)")


class Figures:
    """Counted in the fuzzing process, read by the one that started it: libFuzzer ends without a word."""

    def __init__(self, file: Path) -> None:
        self._layout = struct.Struct(f"={len(COUNTERS)}Q")
        if not file.exists():
            file.write_bytes(bytes(self._layout.size))
        with file.open("r+b") as stream:
            self._shared = mmap.mmap(stream.fileno(), self._layout.size)

    def add(self, **counts: int) -> None:
        """Count on."""
        old = self._layout.unpack_from(self._shared)
        new = (n + counts.get(name, 0) for name, n in zip(COUNTERS, old, strict=True))
        self._layout.pack_into(self._shared, 0, *new)

    def read(self) -> dict[str, int]:
        """All that was counted."""
        return dict(zip(COUNTERS, self._layout.unpack_from(self._shared), strict=True))


def small_calibrations() -> dict[str, str]:
    """The shipped calibration with few rows, alone and with effects: short files are tried more often."""
    shipped = load_calibration(share_file("config/calibration.yaml"))
    t = shipped.damper.static
    every = len(t.velocity_m_s) // 6
    middle = t.velocity_m_s.index(0.0)
    rows = sorted({0, middle, len(t.velocity_m_s) - 1, *range(middle % every, len(t.velocity_m_s), every)})
    static = static_tables(
        t.current_a[::4],
        t.force_n[::4],
        [t.velocity_m_s[k] for k in rows],
        [t.shape[k] for k in rows],
        t.temperature_c[::3],
        t.h_off[::3],
        t.h_on[::3],
        t.off_below_a,
        t.on_above_a,
    )
    damper = replace(shipped.damper, static=static)
    settings = tuple(
        EffectSetting(name, {p.name: min(max(p.typical, p.low), p.high) for p in effect.parameters})
        for name, effect in EFFECTS.items()
    )
    dampers = {"small": damper, "effects": replace(damper, effects=settings)}
    # A few effects at a time too: with all of them, spoiling one hardly matters.
    for k in range(0, len(settings), 3):
        dampers[f"effects_{k}"] = replace(damper, effects=settings[k : k + 3])
    return {
        f"{name}.yaml": render_calibration(name, shipped.provenance, one, {}) for name, one in dampers.items()
    }


def prepare(target: str, folder: Path) -> Path:
    """The files that a target needs, and its seeds in a folder of their own, which is returned."""
    seeds = folder / "seeds"
    seeds.mkdir(exist_ok=True)
    if target == "frames":
        for k, program in enumerate(SEEDS):
            (seeds / str(k)).write_bytes(program)
        return seeds
    shutil.copytree(share_file("dbc/mrctl.dbc").parent, folder / "dbc")
    config = folder / "config"
    shutil.copytree(share_file("config/vehicle.yaml").parent, config)
    small = small_calibrations()
    for name, text in small.items():
        (config / name).write_text(text, encoding="utf-8")
    if target == "calibration":
        texts = [*small.values(), (config / "calibration.yaml").read_text(encoding="utf-8")]
    else:
        texts = [
            (config / f"{name}.yaml")
            .read_text(encoding="utf-8")
            .replace("calibration: calibration.yaml", f"calibration: {one}")
            for name in ("bench", "vehicle", "vehicle_fd")
            for one in ("small.yaml", "effects_0.yaml")
        ]
    for k, text in enumerate(texts):
        (seeds / str(k)).write_text(text, encoding="utf-8")
    return seeds


def loader_target(target: str, folder: Path, figures: Figures) -> Callable[[bytes], None]:
    """Judges a file's text."""
    file = folder / "config" / "spoilt.yaml"

    def judge(data: bytes) -> None:
        file.write_bytes(data)
        problems = judge_file(file, random.Random(data), calibration=target == "calibration")
        figures.add(executions=1, accepted=not problems)

    return judge


def frames_target(figures: Figures) -> Callable[[bytes], None]:
    """Judges what a program of frames makes the tick command."""

    def judge(data: bytes) -> None:
        program = Program(data)
        program.run(TICKS_PER_INPUT)
        figures.add(
            executions=1,
            ticks=program.ticks,
            frames=program.frames,
            commands=program.bus.judge.commands,
        )

    return judge


def spoil_text(data: bytes, size_max: int, seed: int) -> bytes:
    """LibFuzzer's custom mutator: by the sense of the text mostly, else by its bytes."""
    rng = random.Random(seed)
    kind = rng.random()
    if kind < 0.15:
        return atheris.Mutate(data, size_max)
    text = data.decode("utf-8", "replace")
    text = nudge(rng, text) if kind < 0.55 else spoil(rng, text)
    return text.encode("utf-8", "surrogatepass")[:size_max]


def nudge(rng: random.Random, text: str) -> str:
    """The text with some numbers a little off: files that are sound, or nearly so, get to the inverse."""
    found = [at for at in NUMBER.finditer(text) if math.isfinite(float(at.group()))]
    for at in sorted(
        rng.sample(found, min(len(found), rng.choice((1, 2, 5)))), key=Match.start, reverse=True
    ):
        value = float(at.group())
        new = rng.choice((value * rng.uniform(0.9, 1.1), math.nextafter(value, rng.choice((-1e9, 1e9)))))
        text = text[: at.start()] + (repr(new) if "." in at.group() else str(round(new))) + text[at.end() :]
    return text


def fuzz(target: str, folder: Path, words: list[str]) -> None:
    """In the process that is fuzzed; libFuzzer ends it."""
    figures = Figures(folder / "figures")
    judge = frames_target(figures) if target == "frames" else loader_target(target, folder, figures)
    options = {} if target == "frames" else {"custom_mutator": spoil_text}
    atheris.Setup([sys.argv[0], *words], judge, **options)
    atheris.Fuzz()


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("target", choices=sorted(BYTES_MAX))
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--corpus", type=Path, help="folder to begin with and to add to")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.child:
        fuzz(args.target, args.child, (args.child / "words").read_text().split("\n"))
        return 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seeds = prepare(args.target, folder)
        corpus = args.corpus or folder / "corpus"
        corpus.mkdir(parents=True, exist_ok=True)
        figures = Figures(folder / "figures")
        words = [
            f"-max_total_time={round(60 * args.minutes)}",
            f"-max_len={BYTES_MAX[args.target]}",
            f"-seed={args.seed}",
            "-timeout=120",
            "-len_control=0",  # long inputs from the start: a tick has a past
            f"-artifact_prefix=guided_{args.target}_",
            "-print_final_stats=1",
            str(corpus),
            str(seeds),
        ]
        command = [sys.executable, __file__, args.target, "--child", name]
        (folder / "words").write_text("\n".join(words))
        said = []
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, errors="replace") as child:
            with suppress(KeyboardInterrupt):
                for line in child.stderr:
                    if not line.startswith("INFO: Instrumenting"):
                        said += [line] if _DONE.match(line) else []
                        print(line, end="", file=sys.stderr)
            if child.poll() is None:
                child.send_signal(signal.SIGINT)
        counted = figures.read()
        kept = sum(1 for _ in corpus.iterdir())
    found = {kind: (cov, ft) for _, kind, cov, ft, _ in _DONE.findall("".join(said))}
    print(", ".join(f"{n:,} {what}" for what, n in counted.items() if n))
    for kind, what in (("INITED", "with the seeds"), ("DONE", "at the end")):
        if kind in found:
            print(f"coverage {what}: {found[kind][0]} edges, {found[kind][1]} features")
    print(f"{kept} inputs kept; {'no violation' if child.returncode == 0 else 'a VIOLATION, see above'}")
    return 0 if child.returncode == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
