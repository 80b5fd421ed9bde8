"""A run's signals on the clock of the published method's record, and the errors over what it keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from mrctl.identify.paper.prepare import Preparation, Record
from mrctl.measurements.run import Campaign, Run

Array = NDArray[np.float64]

WISH_HZ = 100.0  # race dampers damp little above; what a load cell shows there is noise to an inverse


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
    wish_n: Array  # the measured force up to WISH_HZ, without phase: what an inverse is asked for

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
        force = on_clock(run, record, run.force_n)
        rate = preparation.sample_rate_hz
        wish = sosfiltfilt(butter(2, WISH_HZ, fs=rate, output="sos"), force)
        found.append(
            Signals(
                record,
                1.0 / rate,
                on_clock(run, record, run.velocity_m_s),
                on_clock(run, record, run.current_a),
                on_clock(run, record, run.temperature_c),
                force,
                on_clock(run, record, run.displacement_m),
                on_clock(run, record, run.acceleration_m_s2),
                np.asarray(wish, dtype=np.float64),
            )
        )
    return tuple(found)
