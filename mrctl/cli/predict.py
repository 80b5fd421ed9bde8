"""`mrctl predict`: the model's force beside the measured one."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import islice

import numpy as np

from mrctl.calibration import Calibration
from mrctl.cli.apply import add_common_arguments, apply
from mrctl.identify.pasts import begun
from mrctl.identify.records import Record
from mrctl.measurements import Run
from mrctl.measurements.run import FloatArray
from mrctl.model.pipeline import ForwardPipeline


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl predict`."""
    add_common_arguments(parser)
    parser.epilog = """\
Adds the column force_model_N. The run needs velocity (or displacement), current and temperature; a measured
force is kept, not needed: its first moments say from where the run came, where there is one. Where force and
motion are stored as moving means, so is the model's force.

example:
  mrctl predict config/calibration.yaml run.csv -o predicted.csv
"""


def run(args: argparse.Namespace) -> int:
    """Predict and write."""
    apply(args, "force_model_N", _Forces, need_force=False, need_current=True, finished=_Forces.finished)
    return 0


class _Forces:
    """The model's force, called sample by sample in order, and at the end as the run's own was stored.

    A run slower than the damper's filter goes through the model at a multiple of its rate, and where it has a
    force, its first ones tell what was before it: as in `compare`.
    """

    def __init__(self, calibration: Calibration, run: Run) -> None:
        self._damper = calibration.damper
        self._whole, self._before = begun(self._damper, run, self._forces_of)
        whole = self._whole
        self._steps = self._stepped(whole, whole.driven_m_s if run.has_force else whole.velocity_m_s)
        self._made: list[float] = []

    def __call__(self, k: int) -> float:
        """The force in N at sample k, before any averaging."""
        self._made += islice(self._steps, self._whole.finer if k else self._before + 1)
        return self._made[-1]

    def finished(self) -> FloatArray:
        """All of them in N, averaged as the run's were."""
        return self._whole.as_stored(np.array(self._made))[self._before :: self._whole.finer]

    def _forces_of(self, records: list[Record]) -> list[FloatArray]:
        return [r.as_stored(np.array(list(self._stepped(r, r.driven_m_s)))) for r in records]

    def _stepped(self, record: Record, velocity_m_s: FloatArray) -> Iterator[float]:
        """The model's force in N, sample after sample."""
        v, i, T, x, a = (
            signal.tolist()
            for signal in (
                velocity_m_s,
                record.current_a,
                record.temperature_c,
                record.displacement_m,
                record.acceleration_m_s2,
            )
        )
        model = ForwardPipeline(self._damper, 1.0 / record.rate_hz)
        model.settle(v[0], i[0], T[0], x[0], a[0])
        yield from map(model.step, v, i, T, x, a)
