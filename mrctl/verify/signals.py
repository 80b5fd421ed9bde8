"""A run's signals on the clock of the published method's record, and the errors over what it keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.paper.prepare import Preparation, Record
from mrctl.measurements.run import Campaign, Run

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """n samples each; `record` says which of them count, and has force and velocity after the low-pass."""

    record: Record
    dt_s: float
    velocity_m_s: Array
    current_a: Array
    temperature_c: Array
    force_n: Array
    displacement_m: Array
    acceleration_m_s2: Array

    def percent(self, force_n: Array, wanted_n: Array | None = None) -> float:
        """How far a force (n) is from the measured one, or from another.

        RMS over the kept samples, in percent of the largest wanted force.
        """
        wanted = self.record.cut(self.force_n if wanted_n is None else wanted_n)
        miss = self.record.cut(force_n) - wanted
        return 100.0 * float(np.sqrt(np.mean(miss * miss)) / np.max(np.abs(wanted)))


def on_clock(run: Run, record: Record, values: Array) -> Array:
    """The run's values (as long as the run) at the record's samples."""
    if values.size == record.time_s.size:
        return values
    own = run.time_s[0] + np.arange(values.size) * run.dt_s
    return np.asarray(np.interp(record.time_s, own, values), dtype=np.float64)


def signals_of(campaign: Campaign, preparation: Preparation) -> tuple[Signals, ...]:
    """Those of all runs that the preparation kept."""
    found = []
    for record in preparation.records:
        run = campaign.runs[record.run]
        columns = (
            run.velocity_m_s,
            run.current_a,
            run.temperature_c,
            run.force_n,
            run.displacement_m,
            run.acceleration_m_s2,
        )
        at = [on_clock(run, record, x) for x in columns]
        found.append(Signals(record, 1.0 / preparation.sample_rate_hz, *at))
    return tuple(found)
