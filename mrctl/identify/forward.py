"""A damper's force in a measured run, as the run's own force was stored."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.pasts import begun
from mrctl.identify.records import Record
from mrctl.measurements.run import Run
from mrctl.model.damper import Damper
from mrctl.simulate import simulate

Array = NDArray[np.float64]


def modelled(damper: Damper, run: Run) -> Array:
    """The forward model's force in N (n); EffectError where an effect needs a signal that the run lacks.

    A run slower than the damper's filter goes through the model at a multiple of its rate: between samples
    there are reversals, and the filter cannot be carried down to its rate. Of the measured force only this is
    asked: from where a run came, as it begins (`begun`, Record.driven_m_s).
    """

    def forces_of(records: list[Record]) -> list[Array]:
        return [_force_of(damper, record) for record in records]

    whole, before = begun(damper, run, forces_of)
    return _force_of(damper, whole)[before :: whole.finer]


def _force_of(damper: Damper, record: Record) -> Array:
    """The force in N of a record (n), averaged as the record's own was."""
    return record.as_stored(
        simulate(
            damper,
            1.0 / record.rate_hz,
            record.driven_m_s,
            record.current_a,
            record.temperature_c,
            record.displacement_m,
            record.acceleration_m_s2,
        )
    )
