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

from mrctl.identify import base, hysteresis
from mrctl.identify.effects_fit import Dampers, Effects
from mrctl.identify.layout import Layout, Tables
from mrctl.model.effects.base import Settings, Stage
from mrctl.model.static import StaticTables
from mrctl.simulate import Run, Trace, stages

Array = NDArray[np.float64]

SLOPE_STEP = 1e-4  # of a parameter's scale
PUSH = 1e-4  # of the static force's size, when a slope is pushed through a stage by a difference
VELOCITY_STEP_M_S = 1e-6
STROKE_STEP_M = 1e-6


def linearise(
    run: Run, dampers: Dampers, effects: Effects, theta: Array, factor: int, like: Trace | None
) -> tuple[Trace, base.Rows]:
    """The run's trace, and the force's slopes by all parameters, averaged over `factor` samples."""
    layout, t = dampers.layout, dampers.tables
    settings = effects.settings(theta)
    here = dampers.traced(run, settings, like)
    rate = 1.0 / run.dt_s
    inputs = base.Inputs.of(layout, rate, here.velocity_m_s, here.current_a, here.temperature_c, run.starts)
    gain = np.ones(run.size)
    for by in here.factors.values():
        gain = gain * by
    inner = base.inner_factor(rate, factor)
    slopes = base.slope_rows(inputs, layout, t, inner, gain)
    dt, starts = inner * run.dt_s, run.starts // inner

    def mean(x: Array) -> Array:
        return np.ascontiguousarray(base.averaged(x, inner))

    v, x = mean(here.velocity_m_s), mean(here.displacement_m)
    if settings[Stage.YIELD]:
        level_rows, _ = base.level_rows(inputs, layout, t, np.ones(run.size), inner)
        slopes.static[:] = _pushed(
            slopes.static,
            level_rows,
            mean(here.static_n),
            mean(here.level_n),
            lambda f, lev: stages.yielding(settings[Stage.YIELD], f, v, x, lev, dt, starts),
        )
    bends = _gives_way(settings)
    if bends:
        bare = base.slope_rows(inputs, layout, t)
        by_motion = Motion.of(dampers.static(run), here, settings)
        slopes.static[:], beside = by_motion.rows(bare.static, gain, inner)
    hysteresis.filter_rows(*hysteresis.discretise(t.filter, 1.0 / dt), slopes.static, starts)
    if bends:
        slopes.static[:] += beside
    slopes.add_filter(t, rate, here.yielded_n, here.filtered_n, run.starts)
    by_differences = settings[Stage.MOTION] and not bends
    if (settings[Stage.LIMIT] or settings[Stage.OUTPUT]) and not by_differences:

        def after(force: Array, _: Array) -> Array:
            limited = stages.limited(settings[Stage.LIMIT], force, v, x, dt, starts)
            return stages.measured(settings[Stage.OUTPUT], limited, dt, starts)

        total = mean(here.sum_n)
        slopes.values[:] = _pushed(slopes.values, np.zeros((0, 0)), total, total, after)
    rows = slopes.averaged(factor // inner, effects.size)
    own = rows.index.size
    if by_differences:
        rows.values[:own] = dampers.differences(
            run, np.concatenate([layout.pack(t), theta]), rows.index,
            lambda: _differences(run, layout, t, settings, here, factor, rows.index),
        )  # fmt: skip
    _own_slopes(run, dampers, effects, theta, here, factor, rows.values[own:])
    return here, base.Rows(rows.values, np.concatenate([rows.index, layout.size + np.arange(effects.size)]))


def _differences(
    run: Run,
    layout: Layout,
    t: Tables,
    settings: Settings,
    here: Trace,
    factor: int,
    index: NDArray[np.intp],
) -> Array:
    """The base's slopes as differences of the simulation: where the motion hangs on the tables."""
    theta = layout.pack(t)
    rows = np.zeros((index.size, run.size // factor))
    for row, k in zip(rows, index, strict=True):
        moved = theta.copy()
        moved[k] += SLOPE_STEP
        there = Dampers(layout, layout.unpack(moved)).traced(run, settings, here)
        row[:] = base.averaged(there.force_n - here.force_n, factor) / SLOPE_STEP
    return rows


def _pushed(
    rows: Array, level_rows: Array, at: Array, level: Array, stage: Callable[[Array, Array], Array]
) -> Array:
    """Each slope sent through a stage: what the stage gives beside the point, less what it gives there."""
    here = stage(at, level)
    size = float(np.sqrt(np.mean(at * at))) or 1.0
    out = np.empty_like(rows)
    for k, row in enumerate(rows):
        steepness = float(np.abs(row).max())
        if steepness == 0.0:
            out[k] = 0.0
            continue
        small = PUSH * size / steepness
        beside = level + small * level_rows[k] if k < level_rows.shape[0] else level
        out[k] = (stage(at + small * row, beside) - here) / small
    return out


def _own_slopes(
    run: Run, dampers: Dampers, effects: Effects, theta: Array, here: Trace, factor: int, rows: Array
) -> None:
    """Differences of the force by each effect parameter, away from the nearer bound, into `rows`."""
    _, upper = effects.bounds()
    for k in range(effects.size):
        small = SLOPE_STEP if theta[k] + SLOPE_STEP <= upper[k] else -SLOPE_STEP
        moved = theta.copy()
        moved[k] += small
        there = dampers.traced(run, effects.settings(moved), here)
        rows[k] = base.averaged(there.force_n - here.force_n, factor) / small


def _gives_way(settings: Settings) -> bool:
    """Whether the motion's slopes are known: one effect tells them, and none bends them after it."""
    motion = settings[Stage.MOTION]
    return len(motion) == 1 and motion[0][0].gives_way is not None and not settings[Stage.YIELD]


@dataclass(frozen=True, eq=False)
class Motion:
    """How a run's forces move with the piston's motion, which moves with the static force."""

    here: Trace
    settings: Settings
    damping_n_s_m: Array  # (n) of f g h alone, which is what the motion gives way to
    by_v: Array  # (n) the static force's slopes over the piston's velocity ...
    by_x: Array  # ... and displacement

    @classmethod
    def of(cls, tables: StaticTables, here: Trace, settings: Settings) -> Motion:
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
            here.level_n * (above - below) / (2.0 * dv),
            here.level_n * (above * factors(v + dv, x) - below * factors(v - dv, x)) / (2.0 * dv),
            static * (factors(v, x + dx) - factors(v, x - dx)) / (2.0 * dx),
        )

    def rows(self, bare: Array, gain: Array, factor: int) -> tuple[Array, Array]:
        """Slopes of the static force, and of what comes after the filter: (m, n // factor) each.

        bare (m, n): those of f g h at a given velocity; gain (n): what effects multiply it by.
        """
        run, motion = self.here.run, self.settings[Stage.MOTION]
        by = gain, self.by_v, self.by_x
        before, after = np.zeros((2, bare.shape[0], bare.shape[1] // factor))
        for k, row in enumerate(bare):
            v, x = stages.given_way(
                motion, row, self.damping_n_s_m, run.dt_s, run.starts, by, factor, before[k]
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
