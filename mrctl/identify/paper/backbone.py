"""Sec. 5.2: the backbone of each run, its force averaged over fifty bins of velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.paper.prepare import Preparation, Record

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Backbones:
    """A curve per run, in bins over its own velocities, and all curves at common velocities.

    own_velocity_m_s, own_force_n (runs, bins): means over a bin; NaN where a bin has no sample.
    velocity_m_s (bins): those of the fastest run; force_n (runs, bins): the curves there, NaN where a run
    does not reach.
    """

    own_velocity_m_s: Array
    own_force_n: Array
    velocity_m_s: Array
    force_n: Array

    def peak_n(self) -> Array:
        """The largest magnitude of each curve (runs)."""
        return np.asarray(np.nanmax(np.abs(self.force_n), axis=1), dtype=np.float64)

    def over_time(self, run: int, velocity_m_s: Array) -> Array:
        """The run's backbone force at these velocities: linear between bins, held beyond the outermost."""
        seen = np.isfinite(self.own_force_n[run])
        curve = np.interp(velocity_m_s, self.own_velocity_m_s[run, seen], self.own_force_n[run, seen])
        return np.asarray(curve, dtype=np.float64)


def backbones(preparation: Preparation, bins: int) -> Backbones:
    """The backbones of all runs."""
    curves = [backbone(record, bins) for record in preparation.records]
    own_velocity, own_force = (np.stack(rows) for rows in zip(*curves, strict=True))
    reach = np.nanmax(np.abs(own_velocity), axis=1)
    fastest = int(np.argmax(reach))
    velocity = own_velocity[fastest]
    velocity = velocity[np.isfinite(velocity)]
    # A curve that ends within half a bin of a common velocity counts as reaching it.
    half = 0.5 * float(np.max(np.diff(velocity)))
    force = np.full((len(curves), velocity.size), np.nan)
    for row, (v, f) in enumerate(curves):
        seen = np.isfinite(v)
        near = (velocity >= np.min(v[seen]) - half) & (velocity <= np.max(v[seen]) + half)
        force[row, near] = np.interp(velocity[near], v[seen], f[seen])
    return Backbones(own_velocity, own_force, velocity, force)


def backbone(record: Record, bins: int) -> tuple[Array, Array]:
    """Mean velocity and mean force of the kept samples in each bin (bins each); NaN in empty bins."""
    velocity, force = record.cut(record.velocity_m_s), record.cut(record.force_n)
    top = float(np.max(np.abs(velocity)))
    at = np.clip((0.5 * bins * (velocity / top + 1.0)).astype(np.intp), 0, bins - 1)
    count = np.bincount(at, minlength=bins).astype(np.float64)
    count[count == 0.0] = np.nan
    return np.bincount(at, velocity, bins) / count, np.bincount(at, force, bins) / count
