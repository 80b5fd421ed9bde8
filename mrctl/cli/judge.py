"""`mrctl judge`: whether what is on the bus keeps the safety rules."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from mrctl.judge.frames import Bus, UnusableError, read_dbc
from mrctl.judge.judge import RULES, Judge, Violation
from mrctl.judge.limits import Limits, default_limits, limits_of_config
from mrctl.judge.logs import Seen, frames_of_bus, frames_of_log
from mrctl.share_path import share_file

KEPT = 1000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl judge`."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("log", nargs="?", metavar="LOG", help="candump, ASC, BLF, TRC or MF4")
    where.add_argument("--interface", metavar="CHANNEL", help="watch this CAN interface, e.g. can0")
    parser.add_argument("--driver", default="socketcan", help="python-can's interface (default: %(default)s)")
    parser.add_argument("--duration", type=float, metavar="SECONDS", help="watch for so long")
    parser.add_argument("--dbc", metavar="FILE", help="the bus's DBC (default: that of mrctl)")
    parser.add_argument("--frame", default="CurrentCommand", help="the command frame (default: %(default)s)")
    parser.add_argument("--channel", help="of a log with several: this one only")
    limits = parser.add_argument_group("limits")
    limits.add_argument(
        "--config",
        "-c",
        metavar="FILE",
        help="of a configuration (default: mrctl's, if its commands are the DBC's)",
    )
    limits.add_argument("--current-max", type=float, metavar="A", help="largest current")
    limits.add_argument("--slew", type=float, metavar="A/S", help="largest change of a current")
    limits.add_argument("--cycle-ms", type=float, metavar="MS", help="from one command to the next")
    limits.add_argument("--late-cycles", type=float, metavar="N", help="two commands may be so far apart")
    parser.add_argument("--json", metavar="FILE", help="write the verdict as JSON; - is standard output")
    parser.add_argument("--quiet", action="store_true", help="no line for each violation")
    parser.epilog = f"""\
Shares no code with the controller, only the DBC.
Rules: {", ".join(RULES)}.
Exit status: 0 clean, 1 a rule is broken, 2 nothing can be judged.
Without a configuration that fits, range and cycle are the DBC's, and slew is judged with --slew only.

examples:
  mrctl judge candump.log --config config/vehicle.yaml
  mrctl judge --interface can0 --dbc dbc/mrctl.dbc --current-max 3 --slew 200
"""


def run(args: argparse.Namespace) -> int:
    """Judge, print, write."""
    kept: list[Violation] = []
    try:
        bus = read_dbc(Path(args.dbc or share_file("dbc/mrctl.dbc")), args.frame)
        limits = _limits(args, bus)
        judge = Judge(bus, limits)
        _watch(args, judge, kept)
        _require_commands(args, judge, bus)
        verdict = json.dumps(_verdict(judge, limits, kept), indent=2) + "\n"
        _write(args.json, verdict)
    except UnusableError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if args.json != "-":
        rules = ", ".join(f"{count} {rule}" for rule, count in judge.broken.items())
        print(f"{judge.commands} commands in {judge.frames} frames: {rules or 'no rule broken'}")
    return 1 if judge.broken else 0


def _watch(args: argparse.Namespace, judge: Judge, kept: list[Violation]) -> None:
    """Print violations as they come, keep the first; Ctrl-C ends watching a bus."""
    quiet = args.quiet or args.json == "-"
    try:
        for violation in _judged(args, judge):
            if not quiet:
                print(violation, flush=args.interface is not None)
            if len(kept) < KEPT:
                kept.append(violation)
    except KeyboardInterrupt:
        if args.interface is None:
            raise


def _require_commands(args: argparse.Namespace, judge: Judge, bus: Bus) -> None:
    if not judge.commands:
        what = f"{args.log or args.interface}: has no frames {bus.command.name}"
        raise UnusableError(f"{what}; is it the right log, DBC and --channel?")


def _write(place: str | None, text: str) -> None:
    if place == "-":
        sys.stdout.write(text)
    elif place:
        try:
            Path(place).write_text(text, encoding="utf-8")
        except OSError as error:
            what = f"{place}: cannot be written ({error.strerror})"
            raise UnusableError(f"{what}; choose another place") from error


def _judged(args: argparse.Namespace, judge: Judge) -> Iterator[Violation]:
    if args.interface is None:
        for time_s, identifier, data, channel in frames_of_log(Path(args.log)):
            if args.channel is None or channel == args.channel:
                yield from judge.see(time_s, identifier, data)
        return
    last: Seen | None = None
    waited_s = 0.0
    for seen in frames_of_bus(args.driver, args.interface, args.duration):
        if seen is not None:
            last, waited_s = seen, 0.0
            yield from judge.see(*seen[:3])
        elif last is not None:
            waited_s += 0.01
            yield from judge.silence(last[0] + waited_s)


def _limits(args: argparse.Namespace, bus: Bus) -> Limits:
    names = [signal.name for signal in bus.command.signals]
    if args.config:
        limits = limits_of_config(Path(args.config), bus)
    else:
        limits = limits_of_config(share_file("config/vehicle.yaml"), bus)
        if not set(limits.slew_a_s) <= set(names):  # somebody else's bus
            limits = default_limits(bus)
    given: dict[str, Any] = {}
    if args.current_max is not None:
        given["current_max_a"] = dict.fromkeys(names, args.current_max)
    if args.slew is not None:
        given["slew_a_s"] = dict.fromkeys(names, args.slew)
    if args.cycle_ms is not None:
        given["cycle_s"] = args.cycle_ms / 1000.0
    if args.late_cycles is not None:
        given["late_cycles"] = args.late_cycles
    return replace(limits, **given)


def _verdict(judge: Judge, limits: Limits, kept: list[Violation]) -> dict[str, Any]:
    return {
        "clean": not judge.broken,
        "frames": judge.frames,
        "commands": judge.commands,
        "violations": judge.broken.total(),
        "by_rule": {rule: judge.broken[rule] for rule in RULES},
        "not_judged": [] if limits.slew_a_s else ["slew"],
        "first": [violation._asdict() for violation in kept],
    }
