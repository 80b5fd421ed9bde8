"""Which past a record had: the one with which a model's force is nearest to the first that were measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.records import Record, refined_record
from mrctl.measurements.pasts import PAST_S, Past, pasts_of
from mrctl.measurements.run import Run
from mrctl.model.damper import Damper
from mrctl.model.effects.base import Stage
from mrctl.model.effects.registry import effect

Array = NDArray[np.float64]


def with_pasts(
    records: Sequence[Record],
    forces_of: Callable[[list[Record]], list[Array]],
    came_from_a: Sequence[float] = (),
) -> list[tuple[Record, int]]:
    """Each record with what its first forces say was before it, and how many samples that has.

    forces_of: a model's force in N of records, every sample. came_from_a: currents from which the first one
    may have come. How a model begins by itself is one of the pasts; nothing is fitted.
    """
    early = [r.part(0, 2 * int(PAST_S * r.rate_hz) + 1) for r in records]
    every = [
        pasts_of(
            r.velocity_m_s,
            r.displacement_m,
            r.acceleration_m_s2,
            r.current_a,
            r.rate_hz,
            finer=r.finer,
            came_from_a=came_from_a,
        )
        for r in early
    ]
    asked = [(k, past) for k, own in enumerate(every) for past in own]
    forces = forces_of([_after(early[k], past) for k, past in asked])
    best: dict[int, tuple[float, Past]] = {}
    for (k, past), force in zip(asked, forces, strict=True):
        misses = (early[k].force_n - force[len(past) :])[:: early[k].finer]
        left = float(misses @ misses)
        if k not in best or left < best[k][0]:
            best[k] = left, past
    return [(_after(record, best[k][1]), len(best[k][1])) for k, record in enumerate(records)]


def _after(record: Record, past: Past) -> Record:
    """The record with a past before it; temperature and force as at its first sample."""
    n = len(past)
    if n == 0:
        return record

    def held(x: Array) -> Array:
        return np.concatenate([np.full(n, x[0]), x])

    return replace(
        record,
        velocity_m_s=np.concatenate([past.velocity_m_s, record.velocity_m_s]),
        displacement_m=np.concatenate([past.displacement_m, record.displacement_m]),
        acceleration_m_s2=np.concatenate([past.acceleration_m_s2, record.acceleration_m_s2]),
        current_a=np.concatenate([past.current_a, record.current_a]),
        temperature_c=held(record.temperature_c),
        force_n=held(record.force_n),
    )


def begun(damper: Damper, run: Run, forces_of: Callable[[list[Record]], list[Array]]) -> tuple[Record, int]:
    """A run at the rate of a damper's filter, with what was before it, and how many samples that has.

    forces_of: as `with_pasts` has it. Nothing is before a run without a force, which tells none.
    """
    fine = refined_record(run, damper.forward_filter.sample_rate_hz)
    if not run.has_force:
        return fine, 0
    [told] = with_pasts([fine], forces_of, _currents_before(damper))
    return told


def _currents_before(damper: Damper) -> tuple[float, ...]:
    """The currents in A that a run's first may have come from: both ends, where the damper remembers them."""
    remembers = any(effect(e.name).stage is Stage.CURRENT for e in damper.effects)
    return (0.0, damper.current_max_a) if remembers else ()
