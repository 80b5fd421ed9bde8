"""A run's slopes where the piston gives way: what moves the force moves the piston, and that the force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, filtering
from mrctl.identify.behind import Behind
from mrctl.identify.motion_changes import Change
from mrctl.identify.motion_slopes import Motion
from mrctl.model.effects.base import Stage

Array = NDArray[np.float64]


def bent(
    motion: Motion, behind: Behind, static: Array, level: Array | None, changes: Sequence[Change]
) -> tuple[Array, dict[int, Array]]:
    """The slopes by the base's parameters (s + filter's, n // inner), and by effects' own, by their number.

    static (s, n): the static force's at a given motion, the first of which come with those of f h, level
    (l, n), where the fluid yields by it; changes: what changes with the effects' parameters.
    """
    run, inner, filter_ = motion.here.run, behind.inner, motion.filter
    by_static = [one for one in changes if one.static is not None]
    by_motion = [one for one in changes if one.static is None]
    # In one matrix, to go through the motion's balance side by side; those of the static force first.
    ends = np.cumsum([static.shape[0], len(by_static), filter_.size, len(by_motion)])
    bare, scaled, filters, acting = (slice(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True))
    felt = np.empty((ends[-1], run.size))
    felt[bare] = static
    felt[scaled] = _stacked([one.static for one in by_static], run.size)
    first = felt[: scaled.stop].copy()
    motion.lagged(felt[: scaled.stop])
    felt[filters] = motion.by_filter()
    felt[acting] = _stacked([one.felt for one in by_motion], run.size)
    rows, beside, rod = motion.through(first, level, felt, inner)
    before = rows.copy() if motion.settings[Stage.LIMIT] else None
    behind.filtered(filter_, rows)
    here = motion.here
    own = filtering.sensitivities(filter_, 1.0 / run.dt_s, here.yielded_n, here.filtered_n, run.starts)
    rows[filters] += base.averaged(own, inner)
    if beside is not None:
        rows += beside
        rows[acting] += base.averaged(_stacked([one.beside for one in by_motion], run.size), inner)
    if rod is not None:
        rod[acting] += base.averaged(_stacked([one.on_rod for one in by_motion], run.size), inner)
    rows = behind.limited_and_measured(rows, before, rod)
    numbered = zip((*by_static, *by_motion), (*rows[scaled], *rows[acting]), strict=True)
    return np.concatenate([rows[bare], rows[filters]]), {one.number: row for one, row in numbered}


def _stacked(changes: Sequence[Array | None], size: int) -> Array:
    """Changes (m, size), 0 where there is none."""
    out = np.zeros((len(changes), size))
    for place, change in enumerate(changes):
        if change is not None:
            out[place] = change
    return out
