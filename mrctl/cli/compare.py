"""`mrctl compare`: a model against measurements."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

from mrctl.calibration import load_calibration
from mrctl.cli.diagnosis import data_arguments, load_sound
from mrctl.cli.outputs import check_outputs, given, write_figures
from mrctl.cli.own_effects import try_own_effects
from mrctl.discover.compare import START, Comparison, compare, figures
from mrctl.discover.reports.compare_report import write_report
from mrctl.errors import InputError
from mrctl.model.filters import FilterError
from mrctl.report.progress import Progress
from mrctl.report.terminal import paint, table

MOST_LINES = 8


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl compare`."""
    parser.add_argument("calibration", metavar="CAL", help="the calibration of the damper")
    data_arguments(parser)
    parser.epilog = """\
The noise is what differs from cycle to cycle; a run without three steady cycles has a lower bound only.

example:
  mrctl compare damper.yaml campaign/ --report compare.html
"""


def run(args: argparse.Namespace) -> int:
    """Compare, print, write."""
    check_outputs(args)
    try_own_effects()
    calibration = load_calibration(args.calibration)
    campaign = load_sound(args)
    quiet = args.quiet or args.json == "-"
    with Progress("Comparing", len(campaign), quiet=quiet) as progress:
        try:
            result = compare(calibration.damper, campaign, lambda name: progress.advance(note=name))
        except FilterError as error:
            mend = (
                "the calibration's filter does not suit the sample rate; resample the runs to 500 to 2000 Hz"
            )
            raise InputError.at(campaign.root, f"the hysteresis filter {error}", mend) from error
    if result.of_another:
        mend = "another damper's calibration, or another unit?"
        print(f"warning: {args.calibration}: {result.of_another}; {mend}", file=sys.stderr)
    if args.report:
        words = ["mrctl", "compare", args.calibration, args.data, *given("--columns", args.columns)]
        words += ["--report", args.report]
        write_report(result, calibration, campaign, Path(args.report), shlex.join(words))
    if write_figures(args, figures(result)):
        _print(result)
    return 0


def _print(result: Comparison) -> None:
    rows = [
        [fit.run.name, fit.rmse_n, fit.rmse_percent, fit.fit_percent, fit.bias_n, fit.noise.floor_n]
        for fit in result.runs
    ]
    print(table(["run", "RMSE N", "% of peak", "fit %", "bias N", "noise N"], rows))
    floor = "unknown" if result.noise_floor_n is None else f"{result.noise_floor_n:.3g} N"
    print(f"\nRMSE {result.rmse_n:.3g} N, fit {result.fit_percent:.1f} %, noise {floor}\n{START}")
    print("\n" + paint("Where it fails", "bold"))
    for condition in result.worst[:MOST_LINES]:
        print(f"  {condition.words}")
    if len(result.worst) > MOST_LINES:
        print(f"  and {len(result.worst) - MOST_LINES} more (--json, --report)")
    if not result.worst:
        print(f"  {result.nowhere}")
