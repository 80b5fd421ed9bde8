"""`mrctl dyno`: a campaign of measurements from a damper that is only simulated."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from mrctl.calibration import load_calibration
from mrctl.cli.outputs import check_outputs
from mrctl.cli.own_effects import try_own_effects
from mrctl.errors import InputError
from mrctl.model.baselines.bouc_wen import BoucWen
from mrctl.model.damper import Damper
from mrctl.model.effects.base import EffectError
from mrctl.plant.dyno.campaign import DAMPERS, Bench, DynoRun, with_typical, write_campaign
from mrctl.plant.dyno.parameters import DynoDamper
from mrctl.plant.dyno.protocols import PROTOCOLS
from mrctl.plant.dyno.sensors import FORCE_NOISE_N
from mrctl.printable import printable
from mrctl.report.progress import Progress
from mrctl.report.terminal import table
from mrctl.yaml_source.writer import check_writable, write_atomically


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
        metavar="|".join([*sorted(DAMPERS), "CAL.yaml"]),
        help="whose physics: one like MagneRide's; Spencer's (1997), whose 0 to 2.25 V stand for 0 to 3 A; "
        "or a calibration's, to the letter (default: %(default)s)",
    )
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME",
        help="hide this effect in a calibration's damper, at its typical size; can be given again",
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
The MagneRide-like damper has physics of its own that no calibration holds exactly: without current it behaves
otherwise, its loop changes with current and amplitude, and heat changes the shape of its force too.

protocols:
{protocols}

example:
  mrctl dyno --protocol paper -o campaign && mrctl identify campaign -o calibration.yaml
  mrctl dyno -p road --damper config/calibration.yaml --effect gas_spring -o hidden
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
    _check_outputs(args)
    bench = Bench(_damper(args.damper, args.effect), args.seed, args.noise)
    with Progress(f"dyno, {args.protocol}", len(bench.drives(args.protocol, args.rate))) as progress:
        items = write_campaign(
            bench, args.protocol, Path(args.output), args.rate, lambda name: progress.advance(note=name)
        )
    if args.json:
        result = {
            "protocol": args.protocol,
            "damper": args.damper,
            "effects": args.effect,
            "seed": args.seed,
            "noise_n": args.noise,
            "folder": printable(args.output),
        }
        text = json.dumps({**result, "runs": [_told(item) for item in items]}, indent=2, allow_nan=False)
        text += "\n"
        if args.json == "-":
            print(text, end="")
            return 0
        write_atomically(args.json, text)
    seconds = sum(len(item.run) / item.run.sample_rate_hz for item in items)
    print(f"{args.output}: {len(items)} runs, {seconds:.0f} s of measurement")
    return 0


def _check_outputs(args: argparse.Namespace) -> None:
    """Raises InputError where the folder or the JSON cannot be written; JSON may go into a new folder."""
    folder = Path(args.output)
    if folder.is_dir():
        check_writable(folder / "run.csv")
    inside = args.json is not None and folder in Path(args.json).parents
    others = argparse.Namespace(json=args.json, damper=args.damper)
    check_outputs(others, makes_folder=("json",) if inside else ())


def _damper(name: str, hidden: list[str]) -> DynoDamper | BoucWen | Damper:
    """The damper of this name, or of this calibration, with effects hidden in it."""
    if name in DAMPERS:
        if hidden:
            raise InputError.at(
                "--effect",
                f"cannot be hidden in {name}",
                "name a calibration: --damper config/calibration.yaml",
            )
        return DAMPERS[name]
    if not name.endswith((".yaml", ".yml")):
        raise InputError.at(
            "--damper",
            f"there is none called {name!r}",
            f"take {', '.join(DAMPERS)} or a calibration's YAML file",
        )
    try_own_effects()
    try:
        return with_typical(load_calibration(name).damper, hidden)
    except EffectError as error:
        raise InputError.at("--effect", str(error), "see `mrctl effects`") from None


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
