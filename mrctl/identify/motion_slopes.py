"""How a run's forces move with the piston's motion, where a spring in series lets the damper give way."""

from __future__ import annotations

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
from mrctl.simulate.joined_ways import joined
from mrctl.simulate.step_slopes import StepSlopes, yield_chain, yield_slopes

Array = NDArray[np.float64]
Rows = tuple[Array, Array | None, Array | None]  # (m, n // factor) each; None where nothing acts

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

    def lagged(self, rows: Array) -> None:
        """Changes of the static force (m, n) as the motion comes to feel them, in their own place."""
        filtering.filter_rows(*as_arrays(self.lag_inside(self.filter)), rows, self.here.run.starts)

    def by_filter(self) -> Array:
        """What the motion feels of H's own parameters (m, n)."""
        run, static = self.here.run, self.here.static_n
        lags = [self.lag_inside(self.filter + step) for step in SLOPE_STEP * np.eye(self.filter.size)]
        rows = np.empty((self.filter.size, run.size))
        before = filtering.filtered(*as_arrays(self.lag_inside(self.filter)), static, run.starts)
        for row, lag in zip(rows, lags, strict=True):
            row[:] = filtering.filtered(*as_arrays(lag), static, run.starts) - before
        rows /= SLOPE_STEP
        return rows

    def lag_inside(self, filter_: Array, p: Vector | None = None) -> Coefficients:
        """That of the force which the motion gives way to; p: the motion effect's parameters, if others."""
        _, own, way = self.giving_way
        return way.inside(own if p is None else p, self.plain_lag(filter_))

    def plain_lag(self, filter_: Array) -> Coefficients:
        """H's of these parameters, as the motion effect's step has it."""
        return plain_lag(hysteresis.as_filter(filter_, 1.0 / self.here.run.dt_s).coefficients)

    def through(self, static: Array, level: Array | None, felt: Array, factor: int) -> Rows:
        """Changes of what goes into H, of what comes beside it, and on the rod, averaged over `factor`.

        static (s, n): changes of f g h and its factors at a given motion, of which the first ones come with
        those of f h, level (l, n), where the fluid yields by it; felt (m >= s, n): all changes, the same ones
        first, as the motion feels them.
        """
        by_way, first = self._way
        run, yields = self.here.run, bool(self.settings[Stage.YIELD])
        states = first.shape[1]
        motions = by_way[:, :2] if yields else by_way[:, :0]
        sums = by_way[:, 2 : by_way.shape[1] - states]
        by_force = self.by_v[:, None] * by_way[:, 0] + self.by_x[:, None] * by_way[:, 1]
        after = by_way[:, by_way.shape[1] - states :]
        rows = np.concatenate([by_force[:, None], motions, sums, after], axis=1)
        by = np.zeros((run.size, rows.shape[1], 2 + states))
        by[:, :, [0, *range(2, 2 + states)]] = rows  # of what goes in, all but the static force
        by[:, 0, 1] = 1.0
        force, *rest = carried(by, first, run.starts, felt, static, 1 if yields else factor)
        if yields:
            v, x, *rest = rest
            force = base.averaged(yield_slopes(self._yielding, force, level, (v, x)), factor)
            rest = [base.averaged(one, factor) for one in rest]
        told = iter(rest)
        beside, on_rod = (next(told) if own else None for own in self._acting)
        return force, beside, on_rod

    @cached_property
    def _acting(self) -> tuple[list[StepSlopes], list[StepSlopes]]:
        """How what acts at the piston beside the static force, and on the rod, moves with its motion."""
        run, here = self.here.run, self.here
        rest = run.acceleration_m_s2, here.current_a, here.temperature_c
        signals = here.velocity_m_s, here.displacement_m, *rest
        beside, on_rod = (
            [
                StepSlopes.along(effect, p, signals, (0, 1), (self.tables, run.dt_s), run.starts)
                for effect, p in self.settings[stage]
            ]
            for stage in (Stage.ADDITIVE, Stage.ROD)
        )
        return beside, on_rod

    @cached_property
    def _yielding(self) -> list[StepSlopes]:
        """How what goes into H moves with the static force, the motion and f h."""
        here, chosen = self.here, self.settings[Stage.YIELD]
        signals = here.static_n, here.velocity_m_s, here.displacement_m, here.level_n
        return yield_chain(chosen, signals, self.tables, here.run.dt_s, here.run.starts, (0, 1, 2, 3))

    @cached_property
    def _way(self) -> tuple[Array, Array]:
        """How the motion, what acts beside it and the states move with a force; and the first states.

        (n, 2 + a + k, 1 + k), of a sums of forces those that there are, and (m, k, 2).
        """
        run = self.here.run
        effect, p, (step, start, *_) = self.giving_way
        given_m = run.displacement_m - self.here.displacement_m
        first = np.array([start(p, 1.0, float(by_m)) for by_m in given_m[run.starts[:-1]]], dtype=np.float64)
        states = first.shape[1]
        by = np.empty((run.size, 2 + states, 1 + states))
        loop = compiled(loops.way_slopes, step, f"{effect.name}_way")
        loop(p, self.by_v, self.by_x, given_m, self.lag_inside(self.filter), run.dt_s, by)
        acting = [[one.by for one in own] for own in self._acting if own]
        by, first = heard(*joined(by, first[:, :, None], acting), (0,))
        return by, np.pad(first, ((0, 0), (0, 0), (0, 1)))  # the static force moves none of them

    @property
    def giving_way(self) -> tuple[Effect, Vector, GivesWay]:
        """The motion's effect, its parameters, and how it gives way."""
        ((effect, p),) = self.settings[Stage.MOTION]
        if effect.gives_way is None:
            raise ValueError(f"{effect.name} does not say how it gives way")
        return effect, p, effect.gives_way


def away(value: float, upper: float) -> float:
    """The step of a parameter by which its slope is taken: up, where its bound leaves room."""
    return SLOPE_STEP if value + SLOPE_STEP <= upper else -SLOPE_STEP


def as_arrays(lag: Coefficients) -> tuple[Array, Array]:
    """A filter's numerator (4) and denominator (4)."""
    b0, b1, b2, b3, *a = lag
    return np.array([b0, b1, b2, b3]), np.array([1.0, *a])
