"""How the force behind the yield stage moves with the one before it, for many small changes at once.

The step's own slopes are differences, taken once a sample; every change then goes through them as through a
linear filter whose coefficients change with time, which costs a few products a sample.
"""

from __future__ import annotations

import numpy as np

from mrctl.model.effects.base import Effect, Vector
from mrctl.simulate import loops
from mrctl.simulate.compiled import compiled
from mrctl.simulate.run import Array, Ints
from mrctl.simulate.stages import Chosen, yielding

Signals = tuple[Array, Array, Array, Array]

STEP = 1e-6  # of the RMS of force and level, and of a state's largest value


def yield_slopes(
    chosen: Chosen, signals: Signals, dt_s: float, starts: Ints, rows: Array, level_rows: Array
) -> Array:
    """The changes of the force (m, n) behind the stage.

    chosen: its effects; signals: force, velocity, displacement and level, (n) each; rows (m, n): the changes
    of the force before it, of which the first ones, as many as level_rows (l, n), come with one of the level.
    """
    loop = compiled(loops.carried, loops.linear_step, "carried")
    still = np.zeros(signals[0].size)
    for place, (effect, p) in enumerate(chosen):
        if place:
            signals = yielding([chosen[place - 1]], *signals, dt_s, starts), *signals[1:]
        by, first = _heard(*_step_slopes(effect, p, signals, dt_s, starts))
        behind = np.empty_like(rows)
        for k, row in enumerate(rows):
            level = level_rows[k] if k < level_rows.shape[0] else still
            at = np.stack([row[starts[:-1]], level[starts[:-1]]])
            loop(by, np.einsum("mki,im->mk", first, at), starts, row, level, behind[k])
        rows = behind
    return rows


def _step_slopes(
    effect: Effect, p: Vector, signals: Signals, dt_s: float, starts: Ints
) -> tuple[Array, Array]:
    """Slopes of force and states by force, level and states (n, 1 + k, 2 + k); of first states (m, k, 2)."""
    force, velocity, displacement, level = (x[starts[:-1]] for x in signals)

    def initial(by: float, level_by: float) -> Array:
        firsts = zip(force + by, velocity, displacement, level + level_by, strict=True)
        return np.array([effect.initial(p, *map(float, one), dt_s) for one in firsts], dtype=np.float64)

    states = initial(0.0, 0.0)
    size = states.shape[1]
    peaks = np.zeros(size)
    rest = starts, *signals, dt_s
    compiled(loops.yield_peaks, effect.step, f"{effect.name}_peaks")(p, states.copy(), *rest, peaks)
    small = STEP * np.array([_size(signals[0]), _size(signals[3]), *np.where(peaks > 0.0, peaks, 1.0)])
    first = [(initial(small[0], 0.0) - states) / small[0], (initial(0.0, small[1]) - states) / small[1]]
    by = np.empty((signals[0].size, 1 + size, 2 + size))
    compiled(loops.yield_slopes, effect.step, f"{effect.name}_slopes")(p, states, *rest, small, by)
    return by, np.stack(first, axis=-1)


def _heard(by: Array, first: Array) -> tuple[Array, Array]:
    """The same of those states alone that a change before the stage moves and that the force hears of."""
    size = first.shape[1]
    touches = np.any(by != 0.0, axis=0)
    each = touches[1:, 2:] | np.eye(size, dtype=bool)  # state by state
    moved, heard = touches[1:, :2].any(axis=1) | np.any(first != 0.0, axis=(0, 2)), touches[0, 2:]
    for _ in range(size):
        moved, heard = each @ moved, each.T @ heard
    keep = np.flatnonzero(moved & heard)
    rows, columns = np.concatenate([[0], 1 + keep]), np.concatenate([[0, 1], 2 + keep])
    return np.ascontiguousarray(by[:, rows[:, None], columns]), np.ascontiguousarray(first[:, keep])


def _size(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x))) or 1.0
