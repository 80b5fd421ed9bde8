"""How a run's forces move with the piston's motion, where a spring in series lets the damper give way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, filtering, hysteresis
from mrctl.model.effects.base import Effect, GivesWay, Settings, Stage, Vector
from mrctl.model.filters import Coefficients, plain_lag
from mrctl.model.static import StaticTables
from mrctl.simulate import Trace, loops, stages
from mrctl.simulate.carried import carried, heard
from mrctl.simulate.compiled import compiled
from mrctl.simulate.step_slopes import StepSlopes, yield_chain, yield_slopes

Array = NDArray[np.float64]
Rows = tuple[Array, Array | float, Array | float]  # (m, n // factor) each, or 0 where nothing moves

SLOPE_STEP = 1e-4  # of a parameter's scale
VELOCITY_STEP_M_S = 1e-6
STROKE_STEP_M = 1e-6


@dataclass(frozen=True, eq=False)
class Motion:
    """How a run's forces move with the piston's motion, which moves with the damper's force."""

    tables: StaticTables
    here: Trace
    settings: Settings
    filter: Array  # H's parameters
    by_v: Array  # (n) the static force's slopes over the piston's velocity ...
    by_x: Array  # ... and displacement

    @classmethod
    def of(cls, tables: StaticTables, here: Trace, settings: Settings, filter_: Array) -> Motion:
        """By differences at the run's own motion."""
        v, x = here.velocity_m_s, here.displacement_m
        dv, dx = VELOCITY_STEP_M_S, STROKE_STEP_M

        def factors(v: Array, x: Array) -> Array:
            out = np.ones(v.size)
            for e, p in settings[Stage.FACTOR]:
                out *= stages.factor(
                    e, p, v, x, here.current_a, here.temperature_c, here.run.dt_s, here.run.starts
                )
            return out

        above, below = stages.shape(v + dv, tables), stages.shape(v - dv, tables)
        static = here.level_n * here.shape
        return cls(
            tables,
            here,
            settings,
            filter_,
            here.level_n * (above * factors(v + dv, x) - below * factors(v - dv, x)) / (2.0 * dv),
            static * (factors(v, x + dx) - factors(v, x - dx)) / (2.0 * dx),
        )

    def of_tables(self, bare: Array, level: Array | None, gain: Array, factor: int) -> Rows:
        """Slopes of what goes into H, of what comes beside it, and on the rod.

        bare (m, n): those of f g h at a given velocity, of which the first ones come with those of f h, level
        (l, n), where the fluid yields by it; gain (n): what effects multiply f g h by.
        """
        lagged = bare * gain
        filtering.filter_rows(*self._lag(self.filter), lagged, self.here.run.starts)
        return self._rows(bare, level, lagged, gain, factor)

    def of_filter(self, factor: int) -> Rows:
        """The same by H's own parameters, for the motion's sake alone."""
        run = self.here.run
        static = self.here.static_n
        lagged = filtering.filtered(*self._lag(self.filter), static, run.starts)
        rows = np.empty((self.filter.size, run.size))
        for k, step in enumerate(SLOPE_STEP * np.eye(self.filter.size)):
            rows[k] = filtering.filtered(*self._lag(self.filter + step), static, run.starts) - lagged
        rows /= SLOPE_STEP
        return self._rows(np.zeros_like(rows), None, rows, np.zeros(run.size), factor)

    def _lag_inside(self, filter_: Array) -> Coefficients:
        """That of the force which the motion gives way to."""
        _, p, way = self._giving_way
        return way.inside(p, plain_lag(hysteresis.as_filter(filter_, 1.0 / self.here.run.dt_s).coefficients))

    def _lag(self, filter_: Array) -> tuple[Array, Array]:
        b0, b1, b2, b3, *a = self._lag_inside(filter_)
        return np.array([b0, b1, b2, b3]), np.array([1.0, *a])

    def _rows(self, static: Array, level: Array | None, lagged_n: Array, gain: Array, factor: int) -> Rows:
        by_way, first = self._way
        run = self.here.run
        added, rod = self.settings[Stage.ADDITIVE], self.settings[Stage.ROD]
        # Outputs: the force, and the motion itself where more hangs on it.
        count = 3 if self.settings[Stage.YIELD] or added or rod else 1
        states = first.shape[1]
        by = np.zeros((run.size, count + states, 2 + states))
        rest = [0, *range(2, 2 + states)]  # of what goes in, all but the static force
        by[:, 0, rest] = self.by_v[:, None] * by_way[:, 0] + self.by_x[:, None] * by_way[:, 1]
        by[:, 0, 1] = gain
        by[:, 1:, rest] = by_way[:, 3 - count :]
        if count == 1:
            return carried(by, first, run.starts, lagged_n, static, factor)[0], 0.0, 0.0
        force, v, x = carried(by, first, run.starts, lagged_n, static)
        force = yield_slopes(self._yielding, force, level, (v, x))
        acting = [one.through((0, 1), v, x, factor) for one in self._acting]
        beside, on_rod = sum(acting[: len(added)]), sum(acting[len(added) :])
        return base.averaged(force, factor), beside, on_rod

    @cached_property
    def _acting(self) -> list[StepSlopes]:
        """How what acts at the piston beside the static force moves with its motion, effect by effect."""
        run, here = self.here.run, self.here
        rest = run.acceleration_m_s2, here.current_a, here.temperature_c
        signals = here.velocity_m_s, here.displacement_m, *rest
        return [
            StepSlopes.along(effect, p, signals, (0, 1), (self.tables, run.dt_s), run.starts)
            for stage in (Stage.ADDITIVE, Stage.ROD)
            for effect, p in self.settings[stage]
        ]

    @cached_property
    def _yielding(self) -> list[StepSlopes]:
        """How what goes into H moves with the static force, the motion and f h."""
        here, chosen = self.here, self.settings[Stage.YIELD]
        signals = here.static_n, here.velocity_m_s, here.displacement_m, here.level_n
        return yield_chain(chosen, signals, self.tables, here.run.dt_s, here.run.starts, (0, 1, 2, 3))

    @cached_property
    def _way(self) -> tuple[Array, Array]:
        """How the motion and its states move with a force (n, 2 + k, 1 + k); and the first ones (m, k, 2)."""
        run = self.here.run
        effect, p, (step, start, _) = self._giving_way
        given_m = run.displacement_m - self.here.displacement_m
        first = np.array([start(p, 1.0, float(by_m)) for by_m in given_m[run.starts[:-1]]], dtype=np.float64)
        states = first.shape[1]
        by = np.empty((run.size, 2 + states, 1 + states))
        loop = compiled(loops.way_slopes, step, f"{effect.name}_way")
        loop(p, self.by_v, self.by_x, given_m, self._lag_inside(self.filter), run.dt_s, by)
        by, first = heard(*carrying(by, first[:, :, None], [one.by for one in self._acting]), (0,))
        return by, np.pad(first, ((0, 0), (0, 0), (0, 1)))  # the static force moves none of them

    @property
    def _giving_way(self) -> tuple[Effect, Vector, GivesWay]:
        """The motion's effect, its parameters, and how it gives way."""
        ((effect, p),) = self.settings[Stage.MOTION]
        if effect.gives_way is None:
            raise ValueError(f"{effect.name} does not say how it gives way")
        return effect, p, effect.gives_way


def carrying(way: Array, first: Array, acting: Sequence[Array]) -> tuple[Array, Array]:
    """The way of a motion that gives way to what acts beside the static force too, and its first states.

    way (n, 2 + k, 1 + k): how the piston's velocity, displacement and k states move with a force and the
    states; first (m, k, 1): the first ones; acting (n, 1 + j, 2 + j) each: how a force beside it and its j
    states move with that velocity, displacement and the states, which come behind the k.
    """
    own = way.shape[2]
    states = own - 1 + sum(one.shape[2] - 2 for one in acting)
    if not acting:
        return way, first
    total = np.sum([one[:, 0, :2] for one in acting], axis=0)
    by_v, by_x = np.maximum(total[:, 0], 0.0), total[:, 1]
    # The whole force, of which these make a part by the motion that it makes.
    whole = np.zeros((way.shape[0], 1 + states))
    whole[:, 0] = 1.0
    whole[:, 1:own] = by_v[:, None] * way[:, 0, 1:] + by_x[:, None] * way[:, 1, 1:]
    out = np.zeros((way.shape[0], 2 + states, 1 + states))
    at = own
    for one in acting:
        there = slice(at, at + one.shape[2] - 2)
        whole[:, there] = one[:, 0, 2:]
        out[:, 1 + there.start : 1 + there.stop, there] = one[:, 1:, 2:]
        at = there.stop
    whole /= (1.0 - by_v * way[:, 0, 0] - by_x * way[:, 1, 0])[:, None]
    out[:, : 1 + own] = way[:, :, :1] * whole[:, None, :]
    out[:, : 1 + own, 1:own] += way[:, :, 1:]
    at = 1 + own
    for one in acting:
        there = slice(at, at + one.shape[1] - 1)
        out[:, there] += one[:, 1:, 0, None] * out[:, :1] + one[:, 1:, 1, None] * out[:, 1:2]
        at = there.stop
    return out, np.pad(first, ((0, 0), (0, states - own + 1), (0, 0)))
