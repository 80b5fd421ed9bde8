"""`mrctl demo`: the whole story on a simulated car."""

from __future__ import annotations

import argparse
import json
import os
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mrctl.config import load_config
from mrctl.demo.bus import BusRun, run_on_bus
from mrctl.demo.hidden import can_be_told, tell
from mrctl.demo.report import HEADERS, Outcome, force_error_figure, write_report
from mrctl.demo.scenario import IDEAL, STRATEGIES, TEMPERATURES_C, Result, cases, run_all
from mrctl.errors import InputError
from mrctl.report.progress import Progress
from mrctl.report.terminal import table
from mrctl.share_path import share_file
from mrctl.yaml_source.writer import write_atomically

BUS_SECONDS = 4.0
TOLD_WITH_DESK = "With the desk installed (pip install '.[desk]') it also finds an effect hidden in a damper."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl demo`."""
    parser.add_argument("-o", "--output", default="demo", metavar="DIR", help="folder for report.html")
    parser.add_argument("-c", "--config", metavar="FILE", help="configuration (default: four dampers)")
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON (- is standard output)")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    parser.epilog = """\
Drives one simulated quarter car over the same road again and again: passive, and with skyhook commanded
through a linear current map, Reader's inverse, Liu's, and mrctl's inverse model, with dampers at 25, 55 and
85 °C. Then four dampers on a virtual CAN bus. Ends with a table and DIR/report.html.

With the desk installed it also measures a damper with a hidden effect, discovers it from the CSV files and
commands such dampers with what it found: DIR/campaign, DIR/found.yaml, DIR/found.html, DIR/vehicle.yaml.

example:
  mrctl demo && xdg-open demo/report.html
"""


def run(args: argparse.Namespace) -> int:
    """Run everything, print the table, write the report."""
    started = time.monotonic()
    config = load_config(args.config or share_file("config/vehicle.yaml"))
    path = Path(args.output) / "report.html"
    make_folder(path.parent)  # before the work that would be lost without it
    results: list[Result] = []
    with Progress("Driving", len(cases()), quiet=args.quiet) as progress:
        for result in run_all(config, os.cpu_count() or 1):
            results.append(result)
            progress.advance(note=f"{result.strategy.label}, {result.temperature_c:g} °C")
    with Progress("Four dampers on a virtual CAN bus", quiet=args.quiet):
        bus = run_on_bus(config, BUS_SECONDS)
    story = None
    if can_be_told():
        with Progress("A damper with a hidden effect", 1.0, quiet=args.quiet) as progress:
            story = tell(config, path.parent, progress.update)
    outcome = Outcome(results)
    write_report(outcome, bus, config, path)
    write_atomically(path.with_name("force_error.svg"), force_error_figure(outcome).standalone())
    if args.json:
        figures = _figures(outcome, bus, time.monotonic() - started)
        if story is not None:
            figures["hidden_effect"] = asdict(story)
        text = json.dumps(figures, indent=2, default=str) + "\n"
        if args.json == "-":
            print(text, end="")
            return 0
        Path(args.json).write_text(text, encoding="utf-8")
    print(table(HEADERS, outcome.rows()))
    for line in outcome.findings(config.plant.coil_lag_s):
        print(line)
    print(bus_line(bus))
    print(f"report: {path}")
    for line in [TOLD_WITH_DESK] if story is None else story.lines():
        print(line)
    return 0


def make_folder(path: Path) -> None:
    """Make a folder; InputError where that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError.at(
            path, f"is no folder to write to: {error.strerror}", "name another with -o"
        ) from error


def bus_line(bus: BusRun) -> str:
    """The run on the bus in one sentence."""
    return (
        f"On the bus: {bus.seconds:.1f} s, {bus.frames_to_controller} frames read, {bus.rejected} refused, "
        f"{bus.frames_from_controller} sent; the last command was {bus.rest_a:g} A."
    )


def _figures(outcome: Outcome, bus: BusRun, seconds: float) -> dict[str, Any]:
    return {
        "runs": [
            {
                "strategy": strategy.label,
                "temperature_c": temperature_c,
                "ideal_coil": strategy.ideal_coil,
                **asdict(outcome.of(strategy, temperature_c).metrics),
            }
            for strategy in (*STRATEGIES, *IDEAL)
            for temperature_c in TEMPERATURES_C
        ],
        "error_over_linear_map": {f"{T:g}": outcome.ratio(T) for T in TEMPERATURES_C},
        "error_over_linear_map_ideal_coil": {f"{T:g}": outcome.ratio(T, ideal=True) for T in TEMPERATURES_C},
        "bus": asdict(bus),
        "seconds": seconds,
    }
