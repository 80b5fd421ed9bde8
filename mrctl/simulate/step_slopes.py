"""How the force behind a stage moves with what goes into it, for many small changes at once.

The step's own slopes are differences, taken once a sample; every change then goes through them as through a
linear filter whose coefficients change with time, which costs a few products a sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from mrctl.model.effects.base import Effect, Stage, Step, Vector
from mrctl.model.static import StaticTables
from mrctl.simulate import loops
from mrctl.simulate.carried import carried, heard
from mrctl.simulate.compiled import compiled, divided
from mrctl.simulate.run import Array, Ints
from mrctl.simulate.stages import Chosen, array_tables, limited, yielding

STEP = 1e-7  # of the RMS of a signal, and of a state's largest value; ...
LEAST = 1e-9  # ... but no less than this: in what stands still a difference would be rounding


def yield_slopes(
    chosen: Chosen,
    signals: tuple[Array, Array, Array, Array],
    tables: StaticTables,
    dt_s: float,
    starts: Ints,
    rows: Array,
    level_rows: Array | None,
    motion_rows: tuple[Array, Array] | None = None,
) -> Array:
    """The changes of the force (m, n) behind the yield stage.

    chosen: its effects; signals: force, velocity, displacement and level, (n) each; rows (m, n): the changes
    of the force before it, of which the first ones, as many as level_rows (l, n), come with one of the level;
    motion_rows: the changes of velocity and displacement that come with them, (m, n) each, if any do.
    """
    rest = tables, dt_s
    for place, (effect, p) in enumerate(chosen):
        if place:
            signals = yielding([chosen[place - 1]], *signals, dt_s, starts), *signals[1:]
        rows = _through(effect, p, signals, (0, 3), rest, starts, rows, level_rows)
        if motion_rows is not None:
            rows += _through(effect, p, signals, (1, 2), rest, starts, *motion_rows)
    return rows


def limit_slopes(
    chosen: Chosen,
    signals: tuple[Array, Array, Array, Array, Array, Array],
    tables: StaticTables,
    dt_s: float,
    starts: Ints,
    rows: Array,
    static_rows: Array,
) -> Array:
    """The changes of the force (m, n) behind the limits, by those before them.

    signals: force, velocity, displacement, temperature, static force and level, (n) each; static_rows (l, n):
    the changes of the static force, of which the first ones of rows come. The level stays as it is.
    """
    for place, (effect, p) in enumerate(chosen):
        if place:
            signals = limited([chosen[place - 1]], *signals, tables, dt_s, starts), *signals[1:]
        rows = _through(effect, p, signals, (0, 4), (tables, dt_s), starts, rows, static_rows)
    return rows


def additive_slopes(
    chosen: Chosen,
    signals: tuple[Array, Array, Array, Array, Array],
    tables: StaticTables,
    dt_s: float,
    starts: Ints,
    velocity_rows: Array,
    displacement_rows: Array,
    factor: int,
) -> Array:
    """The changes (m, n // factor) of the forces beside the filter, by those of the motion (m, n) each.

    signals: velocity, displacement, acceleration, current and temperature, (n) each; averaged over `factor`
    samples.
    """
    total = np.zeros((velocity_rows.shape[0], velocity_rows.shape[1] // factor))
    for effect, p in chosen:
        rest = tables, dt_s
        total += _through(effect, p, signals, (0, 1), rest, starts, velocity_rows, displacement_rows, factor)
    return total


def _through(
    effect: Effect,
    p: Vector,
    signals: Sequence[Array],
    of: tuple[int, int],
    rest: tuple[StaticTables, float],
    starts: Ints,
    rows: Array,
    beside: Array | None = None,
    factor: int = 1,
) -> Array:
    """What changes of two of an effect's signals, those at the places `of`, make of its force."""
    try:
        by, first = heard(*_step_slopes(effect, p, signals, of, rest, starts))
    except ArithmeticError as error:
        raise divided(effect, error) from error
    changed: Array = carried(by, first, starts, rows, beside, factor)[0]
    return changed


def _step_slopes(
    effect: Effect,
    p: Vector,
    signals: Sequence[Array],
    of: tuple[int, int],
    rest: tuple[StaticTables, float],
    starts: Ints,
) -> tuple[Array, Array]:
    """Slopes of force and states by two signals and the states (n, 1 + k, 2 + k); of first ones (m, k, 2)."""
    firsts = [x[starts[:-1]] for x in signals]
    beside = rest if effect.stage is Stage.LIMIT else rest[1:]

    def initial(place: int = 0, by: float = 0.0) -> Array:
        each = zip(*(x + by * (place == q) for q, x in enumerate(firsts)), strict=True)
        return np.array([effect.initial(p, *map(float, one), *beside) for one in each], dtype=np.float64)

    states = initial().reshape(starts.size - 1, -1)
    size = states.shape[1]
    largest = np.zeros(size)
    along = starts, np.stack(signals), array_tables(rest[0]), rest[1]
    call = _call(effect.stage, effect.step)
    compiled(loops.peaks, call, f"{effect.name}_peaks")(p, states.copy(), *along, largest)
    sizes = [*(_size(signals[q]) for q in of), *np.where(largest > 0.0, largest, 1.0)]
    small = np.maximum(STEP * np.array(sizes), LEAST)
    first = [(initial(q, by).reshape(states.shape) - states) / by for q, by in zip(of, small, strict=False)]
    idle = () if effect.idle is None else effect.idle(p)
    asked = np.array([0, 1, *(2 + k for k in range(size) if k not in idle)])
    by = np.zeros((signals[0].size, 1 + size, 2 + size))
    compiled(loops.slopes, call, f"{effect.name}_slopes")(p, states, *along, np.array(of), small, asked, by)
    return by, np.stack(first, axis=-1)


@cache
def _call(stage: Stage, step: Step) -> Step:
    return loops.CALLS[stage](step)


def _size(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x))) or 1.0
