"""`mrctl predict`: the model's force beside the measured one."""

from __future__ import annotations

import argparse
from itertools import islice

import numpy as np

from mrctl.calibration import Calibration
from mrctl.cli.apply import add_common_arguments, apply
from mrctl.measurements import Run
from mrctl.measurements.leaps import as_it_moved
from mrctl.measurements.moving_means import smoothed
from mrctl.measurements.refine import refined, refinement, straight
from mrctl.measurements.run import FloatArray
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
    apply(args, "force_model_N", _Forces, need_force=False, need_current=True, finished=_Forces.finished)
    return 0


class _Forces:
    """The model's force, called sample by sample in order, and at the end as the run's own was stored.

    A run slower than the damper's filter goes through the model at a multiple of its rate, as in `compare`.
    """

    def __init__(self, calibration: Calibration, run: Run) -> None:
        there, damper = as_it_moved(run), calibration.damper
        self._factor = refinement(run.sample_rate_hz, damper.forward_filter.sample_rate_hz)
        self._window = run.averaged_s * run.sample_rate_hz * self._factor
        v, x, a = (
            refined(signal, self._factor)
            for signal in (there.velocity_m_s, there.displacement_m, there.acceleration_m_s2)
        )
        i, T = (straight(signal, self._factor) for signal in (there.current_a, there.temperature_c))
        self._signals = zip(*(signal.tolist() for signal in (v, i, T, x, a)), strict=True)
        self._model = ForwardPipeline(damper, 1.0 / (run.sample_rate_hz * self._factor))
        self._model.settle(v[0], i[0], T[0], x[0])
        self._made: list[float] = []

    def __call__(self, k: int) -> float:
        """The force in N at sample k, before any averaging."""
        steps = self._factor if k else 1
        self._made += [self._model.step(*signals) for signals in islice(self._signals, steps)]
        return self._made[-1]

    def finished(self) -> FloatArray:
        """All of them in N, averaged as the run's were."""
        return smoothed(np.array(self._made), self._window)[:: self._factor]
