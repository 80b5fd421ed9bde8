"""A damper's force in a measured run, as the run's own force was stored."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.records import Record
from mrctl.measurements.leaps import as_it_moved
from mrctl.measurements.refine import refinement
from mrctl.measurements.run import Run
from mrctl.model.damper import Damper
from mrctl.simulate import simulate

Array = NDArray[np.float64]


def modelled(damper: Damper, run: Run) -> Array:
    """The forward model's force in N (n); EffectError where an effect needs a signal that the run lacks.

    A run slower than the damper's filter goes through the model at a multiple of its rate: between samples
    there are reversals, and the filter cannot be carried down to its rate. Of the measured force only this is
    asked: where a run begins slowly, from where it came, as in a fit (Record.driven_m_s).
    """
    there = as_it_moved(run)
    factor = refinement(run.sample_rate_hz, damper.forward_filter.sample_rate_hz)
    fine = Record(
        0,
        run.sample_rate_hz,
        there.velocity_m_s,
        there.current_a,
        there.temperature_c,
        np.nan_to_num(there.force_n),
        there.displacement_m,
        there.acceleration_m_s2,
        averaged_s=run.averaged_s,
    ).refined(factor)
    force = simulate(
        damper,
        1.0 / fine.rate_hz,
        fine.driven_m_s,
        fine.current_a,
        fine.temperature_c,
        fine.displacement_m,
        fine.acceleration_m_s2,
    )
    return np.asarray(fine.as_stored(force)[:: fine.finer])
