"""`mrctl diagnose`: which physical effect is missing."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import Any

from mrctl.calibration import Calibration, load_calibration
from mrctl.cli.diagnosis import data_arguments, effects_of, load_sound, print_parameters
from mrctl.cli.identify import damper_errors
from mrctl.cli.outputs import check_outputs, given, write_figures
from mrctl.cli.own_effects import try_own_effects
from mrctl.discover.diagnose import Diagnosis, diagnose
from mrctl.discover.reports.figures import diagnosis_figures
from mrctl.errors import Problem
from mrctl.measurements import Campaign
from mrctl.model.filters import FilterError
from mrctl.report.progress import Progress
from mrctl.report.terminal import paint, table

RANKED = "this effect", "added beside", "RMSE N held out", "removed %", "significant", "rivals"
POOR_FIT, FAR_OFF = 50.0, 3.0  # percent, and times the base's error: a calibration of another damper


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl diagnose`."""
    parser.add_argument("calibration", metavar="CAL", help="the calibration of the damper")
    data_arguments(parser)
    parser.epilog = """\
The base model and the calibration's effects are fitted anew to DATA, so that a calibration made at other
conditions is no missing effect. Verdicts: none, found, ambiguous (and what to measure next), unexplained.

example:
  mrctl diagnose damper.yaml campaign/ --report diagnosis.html
"""


def run(args: argparse.Namespace) -> int:
    """Diagnose, print, write."""
    check_outputs(args)
    try_own_effects()
    calibration = load_calibration(args.calibration)
    known, values = effects_of(calibration)
    campaign = load_sound(args)
    with Progress("Diagnosing", 1.0, quiet=args.quiet or args.json == "-") as progress:
        result = diagnose(campaign, known, values, progress.update)
    _doubt(calibration, campaign, result)
    figures = diagnosis_figures(result)
    if args.report:
        from mrctl.discover.reports.diagnose_report import write_diagnosis  # noqa: PLC0415 - only who asks for it loads it

        words = ["mrctl", "diagnose", args.calibration, args.data, *given("--columns", args.columns)]
        words += ["--report", args.report]
        write_diagnosis(result, figures, campaign, calibration, Path(args.report), shlex.join(words))
    if write_figures(args, figures):
        print_diagnosis(result, figures)
    return 0


def _doubt(calibration: Calibration, campaign: Campaign, result: Diagnosis) -> None:
    """A warning where the calibration is far from what its tables, fitted anew, make of these runs."""
    try:
        errors = damper_errors(campaign, calibration.damper)
    except FilterError:  # of runs sampled too slowly for its filter; the fit has one of its own
        return
    anew_n = result.rmse_n(result.base.mean_square)
    if errors.fit_percent < POOR_FIT and errors.rmse_n > FAR_OFF * anew_n:
        what = f"predicts these runs to {errors.rmse_n:.3g} N, its tables, fitted anew, to {anew_n:.3g} N"
        mend = "is it another damper's? The diagnosis is of the runs"
        print(f"warning: {Problem(str(calibration.path), None, what, mend)}", file=sys.stderr)


def print_diagnosis(result: Diagnosis, figures: dict[str, Any]) -> None:
    """The verdict, the ranking, the parameters, the next run."""
    print(paint(result.verdict, "bold") + ": " + figures["words"])
    if figures["ranking"]:
        rows = [
            [
                e["effect"],
                ", ".join(e["beside"]) or "the base",
                e["rmse_n"],
                e["removed_percent"],
                "yes" if e["significant"] else "no",
                ", ".join(e["rivals"]),
            ]
            for e in figures["ranking"]
        ]
        print("\n" + table([*RANKED], rows))
    for one in figures["found"]:
        print_parameters(one["effect"], one["parameters"], one["derived"])
    if figures["next_run"]:
        n = figures["next_run"]
        print("\n" + paint("Measure next", "bold"))
        stroke = f"sine of {1e3 * n['amplitude_m']:.3g} mm at {n['frequency_hz']:.3g} Hz"
        held = f"{n['temperature_c']:.0f} degC, {n['seconds']:.0f} s"
        print(f"  {stroke}, current {n['current']}, {held}: {n['why']}")
    if figures["cannot_reveal"]:
        print("\n" + paint("What this campaign cannot show", "bold"))
        for name, why in figures["cannot_reveal"].items():
            print(f"  {name}: {why}")
