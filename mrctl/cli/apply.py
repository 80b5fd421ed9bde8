"""What `mrctl predict` and `mrctl invert` have in common: a calibration, a run, a column that is added."""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import numpy as np

from mrctl.calibration import Calibration, load_calibration
from mrctl.cli.outputs import check_outputs
from mrctl.errors import InputError, Problem
from mrctl.measurements import Run, load_run, write_run_csv
from mrctl.measurements.plain_csv import NOT_USED
from mrctl.model.filters import FilterError
from mrctl.report.progress import Progress

SAMPLES_PER_REPORT = 20_000
NEAR_K = 1.0  # of a table that ends at runs' mean temperatures, that their samples lie beside it


def add_common_arguments(parser: argparse.ArgumentParser) -> None:
    """Calibration, run, output, map of foreign files."""
    parser.add_argument("calibration", metavar="CAL", help="calibration, YAML")
    parser.add_argument("run_file", metavar="RUN", help="one run: CSV, or foreign with --columns")
    parser.add_argument(
        "-o", "--output", required=True, metavar="OUT.csv", help="the run with the column added"
    )
    parser.add_argument("--columns", metavar="MAP.yaml", help="names, units and layout of a foreign file")
    parser.add_argument("--quiet", action="store_true", help="no progress")


Model = TypeVar("Model", bound=Callable[[int], float])


def apply(
    args: argparse.Namespace,
    column: str,
    model_of: Callable[[Calibration, Run], Model],
    *,
    need_force: bool,
    need_current: bool,
    finished: Callable[[Model], np.ndarray] | None = None,
) -> tuple[Run, np.ndarray]:
    """Run a model over every sample and write the run with its output; returns both.

    model_of: gives a function from sample number to value, called in order. finished: what the model makes
    of them all at the end. Warnings go to standard error.
    """
    check_outputs(args)
    calibration = load_calibration(args.calibration)
    run = load_run(args.run_file, args.columns, need_force=need_force, need_current=need_current)
    for problem in (*calibration.warnings, *outside_validity(calibration, run, current=need_current)):
        print(f"warning: {problem}", file=sys.stderr)
    try:
        model = model_of(calibration, run)
        values = np.empty(len(run.time_s))
        with Progress(run.name, len(values), quiet=args.quiet) as progress:
            for k in range(len(values)):
                values[k] = model(k)
                if k % SAMPLES_PER_REPORT == 0:
                    progress.update(k)
    except FilterError as error:
        mend = "resample the run, to 500 to 2000 Hz perhaps"
        raise InputError.at(run.file, f"sampled at {run.sample_rate_hz:g} Hz, {error}", mend) from error
    except ArithmeticError as error:  # of an effect of the user's own
        place = traceback.extract_tb(error.__traceback__)[-1]
        mend = "mend it: divide by nothing that can be 0"
        raise InputError.at(place.filename, f"{place.name} fails ({error})", mend, place.lineno) from error
    if finished is not None:
        values = finished(model)
    for note in run.notes:
        if note.startswith(NOT_USED):
            print(f"warning: {Problem(str(run.file), None, note, f'not in {args.output}')}", file=sys.stderr)
    write_run_csv(run, Path(args.output), {column: values})
    return run, values


def outside_validity(calibration: Calibration, run: Run, *, current: bool) -> Iterator[Problem]:
    """Where the run leaves the ranges in which the calibration holds."""
    damper = calibration.damper
    checks = [
        ("velocity", "m/s", run.velocity_m_s, damper.velocity_valid_m_s, 0.0),
        ("temperature", "°C", run.temperature_c, damper.temperature_valid_c, NEAR_K),
    ]
    if current:
        checks.append(("current", "A", run.current_a, damper.current_valid_a, 0.0))
    for name, unit, values, valid, near in checks:
        outside = np.mean((values < valid.low - near) | (values > valid.high + near))
        if outside > 0.0:
            yield Problem(
                str(run.file),
                None,
                f"{100.0 * outside:.3g} % of the {name} lies outside {valid.low:g} to {valid.high:g} {unit}, "
                f"where {calibration.name} holds",
                "its tables hold their end values there",
            )
