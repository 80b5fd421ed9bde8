"""`mrctl replay`: recorded logs through the controller."""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from mrctl.config import load_config
from mrctl.errors import InputError, Problem
from mrctl.replay.candump import STAMP_FORMS
from mrctl.replay.many import Figures, Job, on_this_machine, together
from mrctl.replay.run import CLOCKS, Options, replay
from mrctl.report.progress import Progress
from mrctl.report.terminal import table
from mrctl.yaml_source.writer import write_atomically


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl replay`."""
    parser.add_argument("logs", nargs="+", metavar="LOG", help="candump (.gz too), ASC, BLF, TRC or MF4")
    parser.add_argument("-c", "--config", required=True, metavar="FILE", help="configuration, YAML")
    parser.add_argument(
        "-o",
        "--out",
        metavar="OUT.log",
        help="write what the controller sends; a folder for several logs",
    )
    parser.add_argument(
        "--report", metavar="F.html", help="write a report with pictures; a folder for several logs"
    )
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON; - is standard output")
    parser.add_argument("--quiet", action="store_true", help="no progress, no table")
    reading = parser.add_argument_group("reading")
    reading.add_argument("--interface", help="the log's interface, where it has several or other names")
    reading.add_argument(
        "--stamps",
        choices=STAMP_FORMS,
        default="auto",
        help="candump's time stamps: absolute (also -t z), or delta (-t d); default: found out",
    )
    ticks = parser.add_argument_group("ticks")
    ticks.add_argument(
        "--clock",
        choices=CLOCKS,
        default="auto",
        help="recorded: each command in the log closes a tick; grid: equal steps; default: as the log has",
    )
    ticks.add_argument(
        "--start", type=float, metavar="SECONDS", help="grid: when the controller starts, in the log's time"
    )
    ticks.add_argument(
        "--opened-before",
        type=_seconds,
        default=0.0,
        metavar="SECONDS",
        help="recorded: so long before its start the controller had opened the bus (default: %(default)s)",
    )
    ticks.add_argument(
        "--latency",
        type=_seconds,
        default=0.0,
        metavar="SECONDS",
        help="recorded: a command answers what came at least so long before it (default: %(default)s)",
    )
    many = parser.add_argument_group("many logs")
    many.add_argument("--jobs", type=int, metavar="N", help="logs at once (default: one for each processor)")
    many.add_argument("--fleet", action="store_true", help="through Dask, on a cluster of this machine")
    many.add_argument("--scheduler", metavar="ADDRESS", help="through Dask, on the cluster of this scheduler")
    parser.epilog = """\
Frames of the configuration's channel go through the tick that runs live. Where the log has the controller's
own commands, the re-created ones are compared with them. Remote, error and damaged frames, foreign traffic
and bad lines are counted, never taken for data. Of several logs a broken one is reported, the others go on.

examples:
  candump -l can0                                           # record
  mrctl replay candump-2026-01-31.log -c config/vehicle.yaml -o again.log --report replay.html
  mrctl replay logs/*.blf -c config/vehicle.yaml --json fleet.json
"""


def run(args: argparse.Namespace) -> int:
    """Replay, write, print."""
    options = Options(args.interface, args.stamps, args.clock, args.start, args.opened_before, args.latency)
    if len(args.logs) > 1 or args.fleet or args.scheduler:
        return _many(args, options)
    config = load_config(args.config)
    path, out = Path(args.logs[0]), Path(args.out) if args.out else None
    with Progress("Replaying", 1.0, quiet=args.quiet or args.json == "-") as progress:
        if args.report:
            from mrctl.replay.report import reported  # noqa: PLC0415  # only with a report

            result = reported(
                path,
                config,
                options,
                Path(args.report),
                out=out,
                command=_command(),
                progress=progress.update,
            )
        else:
            result = replay(path, config, options, out=out, progress=progress.update)
    for note in result.notes:
        print(f"note: {path}: {note}", file=sys.stderr)
    _write(args.json, result.figures)
    if not args.quiet and args.json != "-":
        _print([result.figures])
    return 0


def _many(args: argparse.Namespace, options: Options) -> int:
    """Several logs, each a job; exit status 2 when none could be replayed."""
    load_config(args.config)  # its faults once, not for each log
    jobs = [
        Job(log, args.config, options, out, report, _command())
        for log, out, report in zip(
            args.logs,
            _places(args.out, args.logs, ".log"),
            _places(args.report, args.logs, ".html"),
            strict=True,
        )
    ]
    processes = max(1, args.jobs or os.cpu_count() or 1)
    began = time.perf_counter()
    results: list[Figures] = [{} for _ in jobs]
    with Progress("Replaying", len(jobs), quiet=args.quiet or args.json == "-") as progress:
        for number, figures in _finished(args, jobs, processes):
            results[number] = figures
            progress.advance(note=Path(jobs[number].log).name)
    for figures in results:
        for note in figures.get("notes", ()):
            print(f"note: {figures['log']}: {note}", file=sys.stderr)
        for line in figures.get("error", "").splitlines():
            print(f"error: {line}", file=sys.stderr)
    whole = together(results, time.perf_counter() - began)
    _write(args.json, whole)
    if not args.quiet and args.json != "-":
        _print([figures for figures in results if "error" not in figures])
        done = len(jobs) - whole["broken"]
        print(f"\n{done} of {len(jobs)} logs, {whole['realtime_factor']:g} times real time")
    return 2 if whole["broken"] == len(jobs) else 0


def _finished(args: argparse.Namespace, jobs: Sequence[Job], processes: int) -> Iterator[tuple[int, Figures]]:
    if not (args.fleet or args.scheduler):
        return on_this_machine(jobs, processes)
    from mrctl.replay.fleet import on_a_cluster  # noqa: PLC0415  # the extra `fleet`

    return on_a_cluster(jobs, args.scheduler, processes)


def _places(folder: str | None, logs: Sequence[str], suffix: str) -> list[str | None]:
    """A file in the folder for each log, no two the same. Raises InputError where there can be no folder."""
    if folder is None:
        return [None] * len(logs)
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        mend = "several logs need a folder for their outputs"
        raise InputError([Problem(folder, None, f"is no folder ({error.strerror})", mend)]) from error
    taken: set[str] = set()
    places: list[str | None] = []
    for log in logs:
        stem = name = Path(log).name.removesuffix(".gz").removesuffix(".log")
        number = 1
        while name in taken:
            number += 1
            name = f"{stem}-{number}"
        taken.add(name)
        places.append(str(Path(folder) / f"{name}{suffix}"))
    return places


def _seconds(text: str) -> float:
    """A time of at most a minute; argparse tells of the ValueError."""
    value = float(text)
    if not 0.0 <= value <= 60.0:
        raise argparse.ArgumentTypeError(f"{text} is not within 0 and 60 s")
    return value


def _command() -> str:
    return shlex.join(["mrctl", *sys.argv[1:]])


def _write(place: str | None, figures: dict[str, Any]) -> None:
    text = json.dumps(figures, indent=2, allow_nan=False) + "\n"
    if place == "-":
        sys.stdout.write(text)
    elif place:
        write_atomically(place, text)


def _print(results: Sequence[Figures]) -> None:
    headers = [
        "log",
        "s",
        "frames",
        "ticks",
        "commands",
        "rejected",
        "compared",
        "differ",
        "by A",
        "× real time",
    ]
    rows = [
        [
            Path(r["log"]).name,
            r["seconds"],
            r["frames"],
            r["ticks"],
            r["commands"],
            sum(r["rejected"].values()),
            r["compared"]["commands"],
            r["differences"],
            r["compared"]["largest_difference_a"],
            r["realtime_factor"],
        ]
        for r in results
    ]
    print(table(headers, rows))
    if len(results) == 1:
        rejected = results[0]["rejected"]
        if rejected:
            print("\nrejected: " + ", ".join(f"{count} {reason}" for reason, count in rejected.items()))
        for damper, states in results[0]["states_s"].items():
            print(f"{damper}: " + ", ".join(f"{state} {seconds:.3g} s" for state, seconds in states.items()))
