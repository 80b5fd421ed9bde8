"""How the force behind a stage moves with what goes into it, for many small changes at once.

The step's own slopes are differences, taken once a sample; every change then goes through them as through a
linear filter whose coefficients change with time, which costs a few products a sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from mrctl.model.effects.base import Effect, Stage, Step, Vector
from mrctl.model.static import StaticTables
from mrctl.simulate import loops
from mrctl.simulate.carried import carried, heard, touching
from mrctl.simulate.compiled import compiled, divided
from mrctl.simulate.run import Array, Ints
from mrctl.simulate.stages import Chosen, array_tables, limited, yielding

STEP = 1e-7  # of the RMS of a signal, and of a state's largest value; ...
LEAST = 1e-9  # ... but no less than this: in what stands still a difference would be rounding


@dataclass(frozen=True, eq=False)
class StepSlopes:
    """How a step's force, and the states that it leaves, move with some of its signals and with its states.

    of (w): the signals' places; by (n, 1 + k, w + k), of k states those on which something hangs; first
    (m, k, w): how the first states of each stretch move with the signals there; starts (m + 1).
    """

    of: tuple[int, ...]
    by: Array
    first: Array
    starts: Ints

    @classmethod
    def along(
        cls,
        effect: Effect,
        p: Vector,
        signals: Sequence[Array],
        of: Sequence[int],
        rest: tuple[StaticTables, float],
        starts: Ints,
    ) -> StepSlopes:
        """By differences along an effect's own path. Raises InputError where its step divides by zero."""
        firsts = [x[starts[:-1]] for x in signals]
        beside = rest if effect.stage is Stage.LIMIT else rest[1:]

        def initial(place: int = 0, by: float = 0.0) -> Array:
            each = zip(*(x + by * (place == q) for q, x in enumerate(firsts)), strict=True)
            found = [effect.initial(p, *map(float, one), *beside) for one in each]
            return np.array(found, dtype=np.float64).reshape(starts.size - 1, -1)

        path = starts, np.stack(signals), array_tables(rest[0]), rest[1]
        call = _call(effect.stage, effect.step)
        try:
            states = initial()
            idle = () if effect.idle is None else effect.idle(p)
            asked = np.array([k for k in range(states.shape[1]) if k not in idle], dtype=np.int64)
            largest = np.zeros(states.shape[1])
            compiled(loops.peaks, call, f"{effect.name}_peaks")(p, states.copy(), *path, largest)
            sizes = [*(_size(signals[q]) for q in of), *np.where(largest > 0.0, largest, 1.0)[asked]]
            small = np.maximum(STEP * np.array(sizes), LEAST)
            first = [((initial(q, d) - states) / d)[:, asked] for q, d in zip(of, small, strict=False)]
            by = np.empty((signals[0].size, 1 + asked.size, len(of) + asked.size))
            loop = compiled(loops.slopes, call, f"{effect.name}_slopes")
            loop(p, states, *path, np.array(of), asked, small, by)
        except ArithmeticError as error:
            raise divided(effect, error) from error
        return cls(tuple(of), by, np.stack(first, axis=-1), starts)

    def through(
        self, pair: tuple[int, int], rows: Array, beside: Array | None = None, factor: int = 1
    ) -> Array:
        """What changes of two signals, at the places `pair`, make of the force, (m, n // factor)."""
        by, first = heard(self.by, self.first, [self.of.index(one) for one in pair], self._touches)
        changed: Array = carried(by, first, self.starts, rows, beside, factor)[0]
        return changed

    @cached_property
    def _touches(self) -> NDArray[np.bool_]:
        return touching(self.by)


def yield_chain(
    chosen: Chosen,
    signals: tuple[Array, Array, Array, Array],
    tables: StaticTables,
    dt_s: float,
    starts: Ints,
    of: Sequence[int] = (0, 3),
) -> list[StepSlopes]:
    """How each of the yield stage's effects moves with some of its signals, one behind the other.

    signals: force, velocity, displacement and level, (n) each, by the places of which `of` names them.
    """
    found = []
    for place, (effect, p) in enumerate(chosen):
        if place:
            signals = yielding([chosen[place - 1]], *signals, dt_s, starts), *signals[1:]
        found.append(StepSlopes.along(effect, p, signals, of, (tables, dt_s), starts))
    return found


def yield_slopes(
    chain: Sequence[StepSlopes],
    rows: Array,
    level_rows: Array | None,
    motion_rows: tuple[Array, Array] | None = None,
) -> Array:
    """The changes of the force (m, n) behind the yield stage.

    chain: its effects'; rows (m, n): the changes of the force before it, of which the first ones, as many as
    level_rows (l, n), come with one of the level; motion_rows: those of velocity and displacement that come
    with them, (m, n) each, if any do.
    """
    for one in chain:
        rows = one.through((0, 3), rows, level_rows)
        if motion_rows is not None:
            rows += one.through((1, 2), *motion_rows)
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
        rows = StepSlopes.along(effect, p, signals, (0, 4), (tables, dt_s), starts).through(
            (0, 4), rows, static_rows
        )
    return rows


@cache
def _call(stage: Stage, step: Step) -> Step:
    return loops.CALLS[stage](step)


def _size(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x))) or 1.0
