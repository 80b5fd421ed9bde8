"""How each record's force moves with every parameter of base and effects.

The base model's slopes are analytic up to the static force and are then pushed through whatever stages
follow it; the effects' own slopes are differences of the compiled simulation, which repeats only the
stages behind the parameter that moved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, filtering, hysteresis
from mrctl.identify.effects_fit import Dampers, Effects
from mrctl.identify.layout import Layout, Tables
from mrctl.model.effects.base import Settings, Stage
from mrctl.model.filters import plain_lag
from mrctl.model.static import StaticTables
from mrctl.simulate import Run, Trace, stages
from mrctl.simulate.yield_slopes import yield_slopes

Array = NDArray[np.float64]

SLOPE_STEP = 1e-4  # of a parameter's scale
PUSH = 1e-4  # of the static force's size, when a slope is pushed through a stage by a difference
VELOCITY_STEP_M_S = 1e-6
STROKE_STEP_M = 1e-6


def linearise(
    run: Run,
    dampers: Dampers,
    effects: Effects,
    theta: Array,
    factor: int,
    like: Trace | None,
    *,
    picked: bool = False,
) -> tuple[Trace, base.Rows]:
    """The run's trace, and the force's slopes by all parameters, of each `factor` samples what is weighed."""
    layout, t = dampers.layout, dampers.tables
    settings = effects.settings(theta)
    here = dampers.traced(run, settings, like)
    rate = 1.0 / run.dt_s
    inputs = base.Inputs.of(layout, rate, here.velocity_m_s, here.current_a, here.temperature_c, run.starts)
    gain = np.ones(run.size)
    for by in here.factors.values():
        gain = gain * by
    inner = 1 if picked else base.inner_factor(rate, factor)
    slopes = base.slope_rows(inputs, layout, t, inner, gain)
    dt, starts = inner * run.dt_s, run.starts // inner

    def mean(x: Array) -> Array:
        return np.ascontiguousarray(base.averaged(x, inner))

    v, x = mean(here.velocity_m_s), mean(here.displacement_m)
    bends = _gives_way(settings)
    by_differences = settings[Stage.MOTION] and not bends
    if settings[Stage.YIELD] and not by_differences:
        level_rows, _ = base.level_rows(inputs, layout, t, np.ones(run.size), inner)
        signals = mean(here.static_n), v, x, mean(here.level_n)
        slopes.static[:] = yield_slopes(settings[Stage.YIELD], signals, dt, starts, slopes.static, level_rows)
    if bends:
        bare = base.slope_rows(inputs, layout, t).static
        by_motion = Motion.of(dampers.static(run), here, settings, t.filter)
        slopes.static[:], beside = by_motion.of_tables(bare, gain, inner)
        bent, bent_beside = by_motion.of_filter(inner)
    coarse = hysteresis.discretise(t.filter, 1.0 / dt)
    filtering.filter_rows(*coarse, slopes.static, starts)
    slopes.add_filter(t, rate, here.yielded_n, here.filtered_n, run.starts)
    if bends:
        slopes.static[:] += beside
        filtering.filter_rows(*coarse, bent, starts)
        slopes.values[slopes.static.shape[0] :] += bent + bent_beside
    if (settings[Stage.LIMIT] or settings[Stage.OUTPUT]) and not by_differences:

        def after(force: Array) -> Array:
            limited = stages.limited(settings[Stage.LIMIT], force, v, x, dt, starts)
            return stages.measured(settings[Stage.OUTPUT], limited, dt, starts)

        slopes.values[:] = _pushed(slopes.values, mean(here.sum_n), after)
    rows = slopes.in_blocks(factor // inner, effects.size, picked=picked)

    def weighed(force: Array) -> Array:
        return base.in_blocks(force, factor, picked=picked)

    own = rows.index.size
    if by_differences:
        rows.values[:own] = dampers.differences(
            run, np.concatenate([layout.pack(t), theta]), rows.index,
            lambda: _differences(run, layout, t, settings, here, weighed, rows.index),
        )  # fmt: skip
    _own_slopes(run, dampers, effects, theta, here, weighed, rows.values[own:])
    return here, base.Rows(rows.values, np.concatenate([rows.index, layout.size + np.arange(effects.size)]))


def _differences(
    run: Run,
    layout: Layout,
    t: Tables,
    settings: Settings,
    here: Trace,
    weighed: Callable[[Array], Array],
    index: NDArray[np.intp],
) -> Array:
    """The base's slopes as differences of the simulation: where the motion hangs on the tables."""
    theta = layout.pack(t)
    rows = np.zeros((index.size, weighed(here.force_n).size))
    for row, k in zip(rows, index, strict=True):
        moved = theta.copy()
        moved[k] += SLOPE_STEP
        there = Dampers(layout, layout.unpack(moved)).traced(run, settings, here)
        row[:] = weighed(there.force_n - here.force_n) / SLOPE_STEP
    return rows


def _pushed(rows: Array, at: Array, stage: Callable[[Array], Array]) -> Array:
    """Each slope sent through a stage: what the stage gives beside the point, less what it gives there."""
    here = stage(at)
    size = float(np.sqrt(np.mean(at * at))) or 1.0
    out = np.empty_like(rows)
    for k, row in enumerate(rows):
        steepness = float(np.abs(row).max())
        if steepness == 0.0:
            out[k] = 0.0
            continue
        small = PUSH * size / steepness
        out[k] = (stage(at + small * row) - here) / small
    return out


def _own_slopes(
    run: Run,
    dampers: Dampers,
    effects: Effects,
    theta: Array,
    here: Trace,
    weighed: Callable[[Array], Array],
    rows: Array,
) -> None:
    """Differences of the force by each effect parameter, away from the nearer bound, into `rows`."""
    _, upper = effects.bounds()
    for k in range(effects.size):
        small = SLOPE_STEP if theta[k] + SLOPE_STEP <= upper[k] else -SLOPE_STEP
        moved = theta.copy()
        moved[k] += small
        there = dampers.traced(run, effects.settings(moved), here)
        rows[k] = weighed(there.force_n - here.force_n) / small


def _gives_way(settings: Settings) -> bool:
    """Whether the motion's slopes are known: one effect tells them, and none bends them after it."""
    motion = settings[Stage.MOTION]
    return len(motion) == 1 and motion[0][0].gives_way is not None and not settings[Stage.YIELD]


@dataclass(frozen=True, eq=False)
class Motion:
    """How a run's forces move with the piston's motion, which moves with the damper's force."""

    here: Trace
    settings: Settings
    filter: Array  # H's parameters
    damping_n_s_m: Array  # (n) of f g h alone, which is what the motion gives way to
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
            here,
            settings,
            filter_,
            here.level_n * (above - below) / (2.0 * dv),
            here.level_n * (above * factors(v + dv, x) - below * factors(v - dv, x)) / (2.0 * dv),
            static * (factors(v, x + dx) - factors(v, x - dx)) / (2.0 * dx),
        )

    def of_tables(self, bare: Array, gain: Array, factor: int) -> tuple[Array, Array]:
        """Slopes of the static force, and of what comes beside the filter: (m, n // factor) each.

        bare (m, n): those of f g h at a given velocity; gain (n): what effects multiply it by.
        """
        carried = bare.copy()
        filtering.filter_rows(*self._lag(self.filter), carried, self.here.run.starts)
        return self._rows(bare, carried, gain, factor)

    def of_filter(self, factor: int) -> tuple[Array, Array]:
        """The same by H's own parameters, for the motion's sake alone."""
        run = self.here.run
        static = self.here.level_n * self.here.shape
        carried = filtering.filtered(*self._lag(self.filter), static, run.starts)
        rows = np.empty((self.filter.size, run.size))
        for k, step in enumerate(SLOPE_STEP * np.eye(self.filter.size)):
            rows[k] = filtering.filtered(*self._lag(self.filter + step), static, run.starts) - carried
        rows /= SLOPE_STEP
        return self._rows(np.zeros_like(rows), rows, np.zeros(run.size), factor)

    def _lag(self, filter_: Array) -> tuple[Array, Array]:
        b0, b1, b2, b3, *a = plain_lag(hysteresis.as_filter(filter_, 1.0 / self.here.run.dt_s).coefficients)
        return np.array([b0, b1, b2, b3]), np.array([1.0, *a])

    def _rows(self, static: Array, carried: Array, gain: Array, factor: int) -> tuple[Array, Array]:
        run, motion = self.here.run, self.settings[Stage.MOTION]
        by = gain, self.by_v, self.by_x
        lag = plain_lag(hysteresis.as_filter(self.filter, 1.0 / run.dt_s).coefficients)
        before, after = np.zeros((2, static.shape[0], static.shape[1] // factor))
        for k, (row, force) in enumerate(zip(static, carried, strict=True)):
            v, x = stages.given_way(
                motion, row, force, self.damping_n_s_m, lag, run.dt_s, run.starts, by, factor, before[k]
            )
            fastest = float(np.abs(v).max())
            if self.settings[Stage.ADDITIVE] and fastest > 0.0:
                small = VELOCITY_STEP_M_S / fastest
                after[k] = base.averaged(self._added(small * v, small * x), factor) / small
        return before, after

    def _added(self, dv: Array, dx: Array) -> Array:
        """What the forces beside the filter change when the motion does."""
        here, run = self.here, self.here.run
        v, x = here.velocity_m_s + dv, here.displacement_m + dx
        rest = run.acceleration_m_s2, here.current_a, here.temperature_c, run.dt_s, run.starts
        return sum(
            (
                stages.additive(e, p, v, x, *rest) - here.additive_n[e.name]
                for e, p in self.settings[Stage.ADDITIVE]
            ),
            np.zeros(run.size),
        )
