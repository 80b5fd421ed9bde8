"""`mrctl dyno`: a campaign of measurements from a damper that is only simulated."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from mrctl.errors import InputError
from mrctl.plant.dyno.campaign import DAMPERS, Bench, DynoRun, write_campaign
from mrctl.plant.dyno.protocols import PROTOCOLS
from mrctl.plant.dyno.sensors import FORCE_NOISE_N
from mrctl.report.progress import Progress
from mrctl.report.terminal import table
from mrctl.yaml_source.writer import write_atomically


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl dyno`."""
    parser.add_argument(
        "-p",
        "--protocol",
        default="paper",
        choices=sorted(PROTOCOLS),
        help="what to do (default: %(default)s)",
    )
    parser.add_argument(
        "--damper",
        default="magneride",
        choices=sorted(DAMPERS),
        help="whose physics: one like MagneRide's, or Spencer's (1997), whose 0 to 2.25 V stand for 0 to 3 A "
        "(default: %(default)s)",
    )
    parser.add_argument("-o", "--output", metavar="DIR", help="folder for the CSV files, one for each run")
    parser.add_argument("--seed", type=int, default=1, help="same seed, same campaign (default: %(default)s)")
    parser.add_argument(
        "--noise",
        type=float,
        default=FORCE_NOISE_N,
        metavar="N",
        help="RMS of the load cell's noise in N, that of the other sensors in proportion; 0: perfect sensors "
        "(default: %(default)s)",
    )
    parser.add_argument("--rate", type=float, metavar="HZ", help="sample rate (default: the protocol's)")
    parser.add_argument("--list", action="store_true", help="list the protocols and stop")
    parser.add_argument("--json", metavar="FILE", help="write what was done as JSON (- is standard output)")
    protocols = "\n".join(f"  {p.name:<10} {p.summary}" for p in PROTOCOLS.values())
    parser.epilog = f"""\
The damper has physics of its own that no calibration holds exactly: without current it behaves otherwise, its
loop changes with current and amplitude, and heat changes the shape of its force too.

protocols:
{protocols}

example:
  mrctl dyno --protocol paper -o campaign && mrctl identify campaign -o calibration.yaml
"""


def run(args: argparse.Namespace) -> int:
    """Measure and write."""
    if args.list:
        print(table(["protocol", "what it does"], [[p.name, p.summary] for p in PROTOCOLS.values()]))
        return 0
    if not args.output:
        raise InputError.at("-o", "no folder is named", "say where the CSV files go: -o DIR")
    if not 0.0 <= args.noise <= 1e4:
        raise InputError.at("--noise", f"is {args.noise:g} N", "give a number from 0 to 10000")
    if args.rate is not None and not 100.0 <= args.rate <= 20e3:
        raise InputError.at("--rate", f"is {args.rate:g} Hz", "give a number from 100 to 20000")
    if args.seed < 0:
        raise InputError.at("--seed", f"is {args.seed}", "give 0 or more")
    bench = Bench(DAMPERS[args.damper], args.seed, args.noise)
    with Progress(f"dyno, {args.protocol}", len(bench.drives(args.protocol, args.rate))) as progress:
        items = write_campaign(
            bench, args.protocol, Path(args.output), args.rate, lambda name: progress.advance(note=name)
        )
    if args.json:
        result = {
            "protocol": args.protocol,
            "damper": args.damper,
            "seed": args.seed,
            "noise_n": args.noise,
            "folder": args.output,
        }
        text = json.dumps({**result, "runs": [_told(item) for item in items]}, indent=2) + "\n"
        if args.json == "-":
            print(text, end="")
            return 0
        write_atomically(args.json, text)
    seconds = sum(len(item.run) / item.run.sample_rate_hz for item in items)
    print(f"{args.output}: {len(items)} runs, {seconds:.0f} s of measurement")
    return 0


def _told(item: DynoRun) -> dict[str, object]:
    """One run, and what only a simulation knows of it."""
    run = item.run
    return {
        "file": f"{run.name}.csv",
        "seconds": len(run) / run.sample_rate_hz,
        "rate_hz": run.sample_rate_hz,
        "current_mean_a": float(run.current_a.mean()),
        "temperature_start_c": item.drive.temperature_c,
        "fluid_temperature_end_c": float(item.truth.fluid_temperature_c[-1]),
        "velocity_max_m_s": float(np.abs(run.velocity_m_s).max()),
        "force_max_n": float(np.abs(item.truth.force_n).max()),
        "noise_rms_n": float(np.sqrt(np.mean((run.force_n - item.truth.force_n) ** 2))),
    }
