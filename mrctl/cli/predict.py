"""`mrctl predict`: the model's force beside the measured one."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from mrctl.calibration import Calibration
from mrctl.cli.apply import add_common_arguments, apply
from mrctl.measurements import Run
from mrctl.measurements.averaging import as_stored, behind
from mrctl.model.pipeline import ForwardPipeline


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl predict`."""
    add_common_arguments(parser)
    parser.epilog = """\
Adds the column force_model_N. The run needs velocity (or displacement), current and temperature; a measured
force is kept, not needed. Where force and motion are stored as moving means, so is the model's force.

example:
  mrctl predict config/calibration.yaml run.csv -o predicted.csv
"""


def run(args: argparse.Namespace) -> int:
    """Predict and write."""
    apply(args, "force_model_N", _model, need_force=False, need_current=True, finish=as_stored)
    return 0


def _model(calibration: Calibration, run: Run) -> Callable[[int], float]:
    run = behind(run)
    v, i, T, x, a = (
        values.tolist()
        for values in (
            run.velocity_m_s,
            run.current_a,
            run.temperature_c,
            run.displacement_m,
            run.acceleration_m_s2,
        )
    )
    forward = ForwardPipeline(calibration.damper, 1.0 / run.sample_rate_hz)
    forward.settle(v[0], i[0], T[0], x[0])
    return lambda k: forward.step(v[k], i[k], T[k], x[k], a[k])
