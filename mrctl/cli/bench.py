"""`mrctl bench`: benchmarks that compare in one run."""

from __future__ import annotations

import argparse
import json
import platform
from pathlib import Path

from mrctl.bench.tick import measure
from mrctl.config import load_config
from mrctl.report.progress import Progress
from mrctl.report.tables import Cell, Value
from mrctl.report.terminal import table
from mrctl.share_path import share_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl bench`."""
    parser.add_argument(
        "what", choices=["tick"], help="tick: one control tick against python-can + cantools + numpy"
    )
    parser.add_argument(
        "-c", "--config", metavar="FILE", help="configuration (default: four dampers in a car)"
    )
    parser.add_argument("--ticks", type=int, default=10_000, help="ticks to measure (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON (- is standard output)")
    parser.epilog = """\
Absolute times depend on the machine and on what else it does; the ratio is measured tick by tick in turn.

example:
  mrctl bench tick
"""


def run(args: argparse.Namespace) -> int:
    """Measure and print."""
    config = load_config(args.config or share_file("config/vehicle.yaml"))
    with Progress("ticks", args.ticks) as progress:
        cost = measure(config, args.ticks, progress.advance)
    machine = f"{platform.python_implementation()} {platform.python_version()}, {platform.machine()}"
    result = {
        "dampers": len(config.dampers),
        "rate_hz": config.loop.rate_hz,
        "machine": machine,
        "tick_us": cost,
    }
    if args.json:
        text = json.dumps(result, indent=2) + "\n"
        if args.json == "-":
            print(text, end="")
            return 0
        Path(args.json).write_text(text, encoding="utf-8")
    ours = cost["mrctl"]["p50"]
    rows: list[list[Value | Cell]] = [
        [name, q["p50"], q["p99"], q["p99.9"], q["p50"] / ours] for name, q in cost.items()
    ]
    print(
        f"one warm tick, {len(config.dampers)} dampers; frames through each side's own driver code, no kernel"
    )
    print(machine)
    print(table(["", "median, µs", "p99, µs", "p99.9, µs", "times the median of mrctl"], rows))
    return 0
