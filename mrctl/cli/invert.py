"""`mrctl invert`: the current that makes a run's force."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from mrctl.calibration import Calibration
from mrctl.cli.apply import add_common_arguments, apply
from mrctl.measurements import Run
from mrctl.model.pipeline import InversePipeline

SETTLE_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl invert`."""
    add_common_arguments(parser)
    parser.epilog = """\
Takes force_N as the desired force and adds the column current_command_A, worked out sample by sample as the
daemon does it: within the calibration's largest current and slew limit.

example:
  mrctl invert config/calibration.yaml run.csv -o commanded.csv
"""


def run(args: argparse.Namespace) -> int:
    """Invert and write."""
    apply(args, "current_command_A", _model, need_force=True, need_current=False)
    return 0


def _model(calibration: Calibration, run: Run) -> Callable[[int], float]:
    force, v, T, x, a = (
        values.tolist()
        for values in (
            run.force_n,
            run.velocity_m_s,
            run.temperature_c,
            run.displacement_m,
            run.acceleration_m_s2,
        )
    )
    inverse = InversePipeline(calibration.damper, 1.0 / run.sample_rate_hz)
    # Nothing is known of the current before the run: let the first sample's wish have lasted for a while.
    inverse.reset(force[0])
    for _ in range(round(SETTLE_S * run.sample_rate_hz)):
        inverse.step(force[0], v[0], T[0], x[0], a[0])
    return lambda k: inverse.step(force[k], v[k], T[k], x[k], a[k])
