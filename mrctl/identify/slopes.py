"""How each record's force moves with every parameter of base and effects.

The base model's slopes are analytic up to the static force and are then pushed through whatever stages
follow it; the effects' own slopes are differences of the compiled simulation, which repeats only the
stages behind the parameter that moved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, filtering, hysteresis
from mrctl.identify.effects_fit import Dampers, Effects
from mrctl.identify.layout import Layout, Tables
from mrctl.identify.motion_slopes import SLOPE_STEP, Motion
from mrctl.model.effects.base import Settings, Stage
from mrctl.model.static import StaticTables
from mrctl.simulate import Run, Trace
from mrctl.simulate.output_slopes import output_slopes
from mrctl.simulate.step_slopes import limit_slopes, yield_chain, yield_slopes

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def linearise(
    run: Run,
    dampers: Dampers,
    effects: Effects,
    theta: Array,
    factor: int,
    like: Trace | None,
    *,
    picked: bool = False,
    moves: NDArray[np.bool_] | None = None,
) -> tuple[Trace, base.Rows]:
    """The run's trace, and the force's slopes by all parameters, of each `factor` samples what is weighed.

    moves: which of the effects' parameters do; those by the others are 0.
    """
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
    level_rows: Array | None = None
    if settings[Stage.YIELD] and not by_differences:
        level_rows, _ = base.level_rows(inputs, layout, t, np.ones(run.size), 1 if bends else inner)
    if level_rows is not None and not bends:
        signals = mean(here.static_n), v, x, mean(here.level_n)
        chain = yield_chain(settings[Stage.YIELD], signals, dampers.static(run), dt, starts)
        slopes.static[:] = yield_slopes(chain, slopes.static, level_rows)
    rod: Array | None = None
    if bends:
        bare = base.slope_rows(inputs, layout, t).static
        by_motion = Motion.of(dampers.static(run), here, settings, t.filter)
        slopes.static[:], beside, on_rod = by_motion.of_tables(bare, level_rows, gain, inner)
        bent, bent_beside, bent_on_rod = by_motion.of_filter(inner)
    coarse = hysteresis.discretise(t.filter, 1.0 / dt)
    before = slopes.static.copy() if settings[Stage.LIMIT] else None
    filtering.filter_rows(*coarse, slopes.static, starts)
    slopes.add_filter(t, rate, here.yielded_n, here.filtered_n, run.starts)
    if bends:
        slopes.static[:] += beside
        filtering.filter_rows(*coarse, bent, starts)
        slopes.values[slopes.static.shape[0] :] += bent + bent_beside
        rod = np.empty_like(slopes.values)
        rod[: slopes.static.shape[0]] = on_rod
        rod[slopes.static.shape[0] :] = bent_on_rod
    if (settings[Stage.LIMIT] or settings[Stage.OUTPUT] or bends) and not by_differences:
        limited = dampers.static(run), before
        slopes.values[:] = _behind_the_sum(
            settings, here, mean, (v, x), dt, starts, slopes.values, rod, limited
        )
    rows = slopes.in_blocks(factor // inner, effects.size, picked=picked)

    def weighed(force: Array) -> Array:
        return base.in_blocks(force, factor, picked=picked)

    own = rows.index.size
    if by_differences:
        rows.values[:own] = dampers.differences(
            run, np.concatenate([layout.pack(t), theta]), rows.index,
            lambda: _differences(run, layout, t, settings, here, weighed, rows.index),
        )  # fmt: skip
    rows.values[own:] = 0.0
    asked = range(effects.size) if moves is None else np.flatnonzero(moves)
    _own_slopes(run, dampers, effects, theta, asked, here, weighed, rows.values[own:])
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


def _behind_the_sum(
    settings: Settings,
    here: Trace,
    mean: Callable[[Array], Array],
    motion: tuple[Array, Array],
    dt_s: float,
    starts: Ints,
    rows: Array,
    rod: Array | None,
    limited: tuple[StaticTables, Array | None],
) -> Array:
    """The slopes behind what limits the fluid's force, what pulls at the rod, and what measures both.

    mean: of the trace's arrays to the rows' rate; motion: v and x at that; rod: the slopes of what pulls at
    the rod, None where nothing moves it; limited: what a limit needs, the tables and the slopes of what goes
    into H.
    """
    limit, output = settings[Stage.LIMIT], settings[Stage.OUTPUT]
    tables, before = limited
    if limit and before is not None:
        rest = mean(here.temperature_c), mean(here.yielded_n), mean(here.level_n)
        signals = mean(here.sum_n), *motion, *rest
        rows = limit_slopes(limit, signals, tables, dt_s, starts, rows, before)
    if rod is not None:
        rows = rows + rod
    if not output:
        return rows
    return output_slopes(output, mean(here.whole_n), dt_s, starts, rows)


def _own_slopes(
    run: Run,
    dampers: Dampers,
    effects: Effects,
    theta: Array,
    asked: Iterable[int],
    here: Trace,
    weighed: Callable[[Array], Array],
    rows: Array,
) -> None:
    """Differences of the force by the parameters asked for, away from the nearer bound, into `rows`."""
    _, upper = effects.bounds()
    for k in asked:
        small = SLOPE_STEP if theta[k] + SLOPE_STEP <= upper[k] else -SLOPE_STEP
        moved = theta.copy()
        moved[k] += small
        there = dampers.traced(run, effects.settings(moved), here)
        rows[k] = weighed(there.force_n - here.force_n) / small


def _gives_way(settings: Settings) -> bool:
    """Whether the motion's slopes are known: one effect tells them."""
    motion = settings[Stage.MOTION]
    return len(motion) == 1 and motion[0][0].gives_way is not None
