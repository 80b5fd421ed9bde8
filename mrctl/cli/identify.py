"""`mrctl identify`: measurements to calibration."""

from __future__ import annotations

import argparse
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mrctl
from mrctl.calibration import Provenance, Step, calibration_from_damper, dump_calibration
from mrctl.cli.outputs import check_outputs, print_unsaid, write_figures
from mrctl.cli.own_effects import try_own_effects
from mrctl.errors import InputError
from mrctl.identify.best import identify_best
from mrctl.identify.forward import modelled
from mrctl.identify.page import write_page
from mrctl.identify.result import Errors, errors_of
from mrctl.measurements import Campaign, load_campaign, require_sound
from mrctl.measurements.left_out import part
from mrctl.model.damper import Damper
from mrctl.model.filters import FilterError
from mrctl.printable import printable
from mrctl.report.progress import Progress
from mrctl.report.tables import Cell, Value
from mrctl.report.terminal import table

Array = NDArray[np.float64]

METHODS = {
    "best": "joint fit of f, g, h and the hysteresis filter on the time series",
    "paper": "backbone bins, FIR by LMS, third-order IIR, as published",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl identify`."""
    parser.add_argument("data", metavar="DATA", help="a campaign: folder of runs, or one file")
    parser.add_argument("-o", "--output", required=True, metavar="CAL.yaml", help="the calibration to write")
    parser.add_argument("--method", choices=sorted(METHODS), default="best", help="default: best")
    parser.add_argument("--columns", metavar="MAP.yaml", help="names, units and layout of foreign files")
    parser.add_argument("--name", help="what to call the damper (default: the folder's name)")
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON; - is standard output")
    parser.add_argument("--report", metavar="F.html", help="write a report with pictures")
    parser.add_argument("--leave-out", metavar="NAMES", help="fit without runs of such names; predict them")
    parser.add_argument("--quiet", action="store_true", help="no progress, no table")
    parser.epilog = """\
`best` takes any campaign and says what it could not learn from it; `paper` needs runs at constant currents.

examples:
  mrctl identify campaign/ -o damper.yaml --report damper.html
  mrctl identify campaign/ -o damper.yaml --leave-out '*_5Hz_*'
"""


def run(args: argparse.Namespace) -> int:
    """Identify, print, write."""
    began = time.monotonic()
    check_outputs(args)
    try_own_effects()
    campaign = load_campaign(args.data, args.columns)
    for problem in require_sound(campaign):
        print(f"warning: {problem}", file=sys.stderr)
    campaign, left_out = part(campaign, args.leave_out)
    damper, std, notes = _identified(args, campaign)
    forces = damper_forces(campaign, damper)
    errors = errors_of(campaign, list(range(len(forces))), forces)
    name = damper_name(args)
    history = (
        Step(
            what="identify",
            effects=tuple(e.name for e in damper.effects),
            date=datetime.now(UTC).date().isoformat(),
            data=printable(args.data),
            version=mrctl.__version__,
        ),
    )
    provenance = Provenance(
        source=f"{len(errors.runs)} runs in {printable(args.data)}",
        created=datetime.now(UTC).date().isoformat(),
        method=" ".join(
            [f"mrctl identify --method {args.method}: {METHODS[args.method]}.", *kept_out(args), *notes]
        ),
        data_sha256=campaign.sha256,
        history=history,
    )
    dump_calibration(calibration_from_damper(name, damper, provenance, std), args.output)
    figures = _figures(args, damper, errors, notes, time.monotonic() - began)
    if left_out.runs:
        figures["left_out"] = prediction(left_out, damper)
    if args.report:
        by_run = {run.name: force for run, force in zip(campaign.runs, forces, strict=True)}
        write_page(Path(args.report), name, args.method, campaign, damper, std, errors, by_run, notes)
    if write_figures(args, figures):
        _print(errors, notes, args.output)
        if left_out.runs:
            print(f"left out: {said(figures['left_out'])}")
    return 0


def _identified(
    args: argparse.Namespace, campaign: Campaign
) -> tuple[Damper, dict[str, tuple[float, ...]], list[str]]:
    """Damper, standard deviations, what was assumed or is not known."""
    with Progress(f"Identifying ({args.method})", 1.0, quiet=args.quiet or args.json == "-") as progress:
        if args.method == "paper":
            from mrctl.identify.paper import identify_paper  # noqa: PLC0415 - only who asks for it loads it

            paper = identify_paper(campaign)
            for problem in paper.left_out:
                print(f"warning: {problem}", file=sys.stderr)
            return paper.damper, {}, list(paper.notes)
        result = identify_best(campaign, lambda done, total, what: progress.update(done / total, what))
    return result.damper, result.std, [f"{finding}." for finding in result.findings]


def damper_name(args: argparse.Namespace) -> str:
    """What the user calls the damper, else the name of where its measurements are."""
    return printable(args.name or Path(args.data).resolve().stem)


def kept_out(args: argparse.Namespace) -> list[str]:
    """What the calibration says of runs that were left out."""
    return [f"Without the runs {printable(args.leave_out)}."] if args.leave_out else []


def prediction(left_out: Campaign, damper: Damper) -> dict[str, Any]:
    """How well a damper predicts runs that no fit has seen: their files, RMSE in N and fit in percent.

    Raises InputError where they are sampled too slowly for its filter.
    """
    try:
        errors = damper_errors(left_out, damper)
    except FilterError as error:
        raise InputError.at(left_out.root, str(error), "leave out runs at 500 Hz or faster") from error
    return {
        "files": [run.name for run in left_out.runs],
        "rmse_n": errors.rmse_n,
        "fit_percent": errors.fit_percent,
    }


def said(figures: dict[str, Any]) -> str:
    """A prediction in words."""
    count = len(figures["files"])
    runs = "1 run" if count == 1 else f"{count} runs"
    return f"{runs} predicted with RMSE {figures['rmse_n']:.3g} N, fit {figures['fit_percent']:.1f} %"


def damper_errors(campaign: Campaign, damper: Damper) -> Errors:
    """How well a damper predicts runs. Raises FilterError where its filter does not suit their rate."""
    return errors_of(campaign, list(range(len(campaign))), damper_forces(campaign, damper))


def damper_forces(campaign: Campaign, damper: Damper) -> list[Array]:
    """The forward model's force in N (n) in every run of the campaign."""
    return [modelled(damper, run) for run in campaign.runs]


def _figures(
    args: argparse.Namespace, damper: Damper, errors: Errors, notes: list[str], seconds: float
) -> dict[str, Any]:
    return {
        "method": args.method,
        "calibration": printable(args.output),
        "effects": [e.name for e in damper.effects],
        "rmse_n": errors.rmse_n,
        "fit_percent": errors.fit_percent,
        "rmse_percent_on": errors.rmse_percent_on,
        "rmse_percent_off": errors.rmse_percent_off,
        "runs": [
            {
                "file": row.file,
                "current_a": row.current_a,
                "temperature_c": row.temperature_c,
                "rmse_n": row.rmse_n,
                "rmse_percent": row.rmse_percent,
                "fit_percent": row.fit_percent,
            }
            for row in errors.runs
        ],
        "not_identified": notes,
        "seconds": seconds,
    }


def _print(errors: Errors, notes: list[str], output: str) -> None:
    rows: list[list[Value | Cell]] = [
        [row.file, row.current_a, row.temperature_c, row.rmse_n, row.rmse_percent, row.fit_percent]
        for row in errors.runs
    ]
    print(table(["run", "A", "degC", "RMSE N", "% of peak", "fit %"], rows))
    groups = [
        f"{label} {value:.2f} % of peak"
        for label, value in (("on", errors.rmse_percent_on), ("off", errors.rmse_percent_off))
        if value is not None
    ]
    print(f"\nRMSE {errors.rmse_n:.3g} N, fit {errors.fit_percent:.1f} %" + "".join(f", {g}" for g in groups))
    print_unsaid(notes)
    print(f"\nwritten: {output}")
