"""`mrctl discover`: measurements to a calibration with every effect that they bear out."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from mrctl.cli.diagnose import print_diagnosis
from mrctl.cli.diagnosis import data_arguments, extension_figures, fast_enough, load_sound
from mrctl.cli.extend import print_extension
from mrctl.cli.identify import damper_name, kept_out, prediction, said
from mrctl.cli.outputs import check_outputs, given, write_figures
from mrctl.cli.own_effects import try_own_effects
from mrctl.discover.discover import Discovery, discover
from mrctl.discover.extended_calibration import write_extended
from mrctl.discover.reports.figures import diagnosis_figures
from mrctl.identify.best import identify_best
from mrctl.measurements import Campaign
from mrctl.measurements.left_out import part
from mrctl.model.damper import Damper
from mrctl.report.progress import Progress

IDENTIFY_SHARE = 0.05  # of the time, about


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl discover`."""
    data_arguments(parser)
    parser.add_argument("-o", "--output", required=True, metavar="CAL.yaml", help="the calibration to write")
    parser.add_argument("--name", help="what to call the damper (default: the folder's name)")
    parser.add_argument(
        "--leave-out",
        metavar="NAMES",
        help="find and fit without runs of such names, and predict them with and without what was found",
    )
    parser.epilog = """\
Of effects that the data cannot tell apart the best is added only where it foretells motions left out; the
next run to make, which tells them apart, is proposed.

examples:
  mrctl discover campaign/ -o damper.yaml --report discovery.html
  mrctl discover campaign/ -o damper.yaml --leave-out '*_5Hz_*'
"""


def run(args: argparse.Namespace) -> int:
    """Discover, print, write."""
    check_outputs(args)
    try_own_effects()
    campaign, left_out = part(load_sound(args), args.leave_out)
    result, alone = _discovered(args, campaign, compared=bool(left_out.runs))
    extension = result.extension
    name, notes = damper_name(args), kept_out(args)
    write_extended(extension, name, campaign, args.data, args.output, "discover", notes=notes)
    diagnosis = diagnosis_figures(result.diagnosis)
    figures = {
        **extension_figures(extension),
        "history": [
            {"effects": list(names), "rmse_n": rmse, "noise_floor_n": extension.noise_floor_n}
            for names, rmse in extension.steps
        ],
        "verdict": result.verdict,
        "words": result.words,
        "diagnosis": diagnosis,
        "next_run": diagnosis["next_run"],
    }
    if alone is not None:
        figures["left_out"] = {
            "identify": prediction(left_out, alone),
            "discover": prediction(left_out, extension.damper),
        }
    if args.report:
        from mrctl.discover.reports.discover_report import write_discovery  # noqa: PLC0415 - only who asks for it loads it

        words = ["mrctl", "discover", args.data, *given("--columns", args.columns), "-o", args.output]
        words += [*given("--name", args.name), *given("--leave-out", args.leave_out)]
        words += ["--report", args.report]
        write_discovery(result, diagnosis, campaign, Path(args.report), shlex.join(words))
    if write_figures(args, figures):
        print_diagnosis(result.diagnosis, diagnosis)
        print_extension(figures, args.output)
        if left_out.runs:
            for what, figure in figures["left_out"].items():
                print(f"left out, by {what}: {said(figure)}")
        print(f"\nnow: {result.verdict}. {result.words}")
    return 0


def _discovered(
    args: argparse.Namespace, campaign: Campaign, *, compared: bool
) -> tuple[Discovery, Damper | None]:
    """What was found; where that is to be compared, also the damper that `identify` makes of the same runs.

    That one comes first: it takes a small part of the time, and what stops it should not cost the rest.
    """
    begin, alone = 0.0, None
    quiet = args.quiet or args.json == "-"
    with Progress("Discovering", 1.0, quiet=quiet) as progress, fast_enough(campaign):
        if compared:
            begin = IDENTIFY_SHARE
            alone = identify_best(campaign, lambda k, n, what: progress.update(begin * k / n, what)).damper
        found = discover(campaign, lambda x, what: progress.update(begin + (1.0 - begin) * x, what))
    return found, alone
