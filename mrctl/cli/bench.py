"""`mrctl bench`: benchmarks that compare in one run."""

from __future__ import annotations

import argparse
import json
import platform
from pathlib import Path
from typing import Any

from mrctl.bench import c_tick, lateness, replay, tick
from mrctl.config import Config, load_config
from mrctl.report.progress import Progress
from mrctl.report.tables import Cell, Value
from mrctl.report.terminal import table
from mrctl.runtime.compiled import COMPILED
from mrctl.share_path import share_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl bench`."""
    parser.add_argument(
        "what",
        choices=["tick", "lateness", "c-tick", "replay", "model", "lms"],
        help="tick: one control tick against python-can + cantools + numpy; lateness: waking up against "
        "cyclictest; c-tick: the tick against the same compiled in C; replay: a log against python-can's "
        "reader with cantools; model: a sample of the forward and inverse model against numpy and scipy; "
        "lms: the adaptive filter of `identify --method paper` against padasip's",
    )
    parser.add_argument(
        "-c", "--config", metavar="FILE", help="configuration (default: four dampers in a car)"
    )
    parser.add_argument("--ticks", type=int, default=10_000, help="ticks to measure (default: %(default)s)")
    parser.add_argument(
        "--seconds", type=float, default=300.0, help="of lateness, both sides (default: %(default)s)"
    )
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON (- is standard output)")
    parser.epilog = """\
Absolute times depend on the machine and on what else it does; the sides take turns, so that the ratio holds.
lateness wants a real-time priority (as root) and an idle machine.

examples:
  mrctl bench tick
  mrctl bench lateness --seconds 60
  mrctl bench c-tick
  mrctl bench replay
  mrctl bench model
  mrctl bench lms
"""


def run(args: argparse.Namespace) -> int:
    """Measure and print."""
    machine = f"{platform.python_implementation()} {platform.python_version()}, {platform.machine()}"
    result: dict[str, Any] = {"machine": machine}
    if args.what in {"lms", "model"}:
        figures, text = _lms() if args.what == "lms" else _model()
    else:
        config = load_config(args.config or share_file("config/vehicle.yaml"))
        result |= {"dampers": len(config.dampers), "rate_hz": config.loop.rate_hz}
        sides = {"tick": _tick, "lateness": _lateness, "c-tick": _c_tick, "replay": _replay}
        figures, text = sides[args.what](config, args)
        machine = f"{len(config.dampers)} dampers; {machine}"
    result |= figures
    if args.json:
        written = json.dumps(result, indent=2) + "\n"
        if args.json == "-":
            print(written, end="")
            return 0
        Path(args.json).write_text(written, encoding="utf-8")
    print(machine)
    print(text)
    return 0


def _tick(config: Config, args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    with Progress("ticks", args.ticks) as progress:
        cost = tick.measure(config, args.ticks, progress.advance)
    ours = cost["mrctl"]["p50"]
    rows: list[list[Value | Cell]] = [
        [name, q["p50"], q["p99"], q["p99.9"], q["p50"] / ours] for name, q in cost.items()
    ]
    title = "one warm tick; frames through each side's own driver code, no kernel"
    heads = ["", "median, µs", "p99, µs", "p99.9, µs", "times the median of mrctl"]
    return {"tick_us": cost}, table(heads, rows, title=title)


def _lateness(config: Config, args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    lateness.cyclictest()
    with Progress("seconds", round(args.seconds)) as progress:
        late = lateness.measure(config, args.seconds, progress.advance)
    rows: list[list[Value | Cell]] = [[name, *q.values()] for name, q in late.items()]
    mine, theirs = late.values()
    rows.append(
        ["ratio", *(Cell(mine[q], text=f"{mine[q] / max(theirs[q], 1.0):.2f}") for q in lateness.QUANTILES)]
    )
    title = f"µs from when a tick is due to when it runs, at {config.loop.rate_hz:g} Hz"
    return {"lateness_us": late}, table(["", *lateness.QUANTILES], rows, title=title, digits=4)


def _c_tick(config: Config, args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    c_tick.compiler()
    with Progress("ticks", max(args.ticks, 2 * c_tick.SETTLED_AFTER)) as progress:
        cost = c_tick.measure(config, args.ticks, progress.advance)
    rows: list[list[Value | Cell]] = [
        ["mrctl, compiled" if COMPILED else "mrctl, Python", cost.python_us, cost.python_us / cost.c_us],
        ["the same in C", cost.c_us, 1.0],
    ]
    title = "a tick without reception and sending"
    text = table(["", "µs", "times C"], rows, title=title)
    figures = {"python_us": cost.python_us, "c_us": cost.c_us, "difference_a": cost.difference_a}
    return {"c_tick": figures}, f"{text}\nlargest difference of a command: {1e3 * cost.difference_a:.0f} mA"


def _replay(config: Config, args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    rounds = 3
    with Progress("turns", 4 * rounds) as progress:
        cost = replay.measure(config, args.ticks, rounds, progress.advance)
    ours = cost.cpu_s[replay.OURS]
    rows: list[list[Value | Cell]] = [
        [name, 1e6 * cpu_s / cost.frames, cost.realtime_factor(name), cpu_s / ours]
        for name, cpu_s in cost.cpu_s.items()
    ]
    title = f"a log of {cost.frames} frames, {cost.seconds:g} s at {config.loop.rate_hz:g} Hz, CPU time"
    figures = {"frames": cost.frames, "seconds": cost.seconds, "cpu_s": cost.cpu_s}
    heads = ["", "a frame, µs", "× real time", "times mrctl replay"]
    return {"replay": figures}, table(heads, rows, title=title)


def _model() -> tuple[dict[str, Any], str]:
    from mrctl.bench.model import measure  # noqa: PLC0415  # numba and scipy, which the loop's sides do not need

    rounds = 5
    with Progress("turns", rounds) as progress:
        cost = measure(rounds, progress.advance)
    rows: list[list[Value | Cell]] = [
        [name, 1e6 * ours, 1e6 * theirs, 1.0 / ours, theirs / ours]
        for name, (ours, theirs) in cost.seconds.items()
    ]
    heads = ["", "mrctl, µs a sample", "numpy and scipy, µs", "mrctl, samples a second", "times mrctl"]
    words = f"largest difference of the forward force: {cost.difference_n:.2g} N of {cost.largest_n:.4g} N"
    text = table(heads, rows, title="one damper; the peers do the formula alone")
    seconds = {name: {"mrctl": ours, "peer": theirs} for name, (ours, theirs) in cost.seconds.items()}
    figures = {
        "seconds_per_sample": seconds, "difference_n": cost.difference_n, "largest_n": cost.largest_n,
    }  # fmt: skip
    return {"model": figures}, f"{text}\n{words}"


def _lms() -> tuple[dict[str, Any], str]:
    from mrctl.bench.lms import lms_rows, measure_lms  # noqa: PLC0415  # numba, which no other side needs

    rounds = 3
    with Progress("turns", rounds) as progress:
        cost = measure_lms(rounds, progress.advance)
    title = f"one run of {cost.samples} samples, {cost.taps} taps, the same data and step on both sides"
    text = table(*lms_rows(cost), title=title)
    figures = {
        "samples": cost.samples,
        "taps": cost.taps,
        "pass_s": cost.pass_s,
        "padasip_pass_s": cost.padasip_pass_s,
        "times_faster": cost.times_faster,
        "passes": cost.passes,
        "passes_s": cost.passes_s,
        "padasip_passes_s": cost.padasip_passes_s,
        "difference": cost.difference,
        "largest": cost.largest,
    }
    words = f"largest difference of a coefficient: {cost.difference:.2g}, of {cost.largest:.2g}"
    guess = f"padasip's {cost.passes} passes are its one pass times {cost.passes}; mrctl's are measured"
    return {"lms": figures}, f"{text}\n{words}\n{guess}"
