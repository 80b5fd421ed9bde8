"""How each record's force moves with every parameter of base and effects.

The base model's slopes are analytic up to the static force and are then pushed through whatever stages
follow it; the effects' own slopes are differences of the compiled simulation, which repeats only the
stages behind the parameter that moved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base
from mrctl.identify.behind import Behind
from mrctl.identify.bent import bent
from mrctl.identify.effects_fit import Dampers, Effects
from mrctl.identify.layout import Layout, Tables
from mrctl.identify.motion_changes import changes_of
from mrctl.identify.motion_slopes import SLOPE_STEP, Motion, away
from mrctl.model.effects.base import Settings, Stage
from mrctl.simulate import Run, Trace

Array = NDArray[np.float64]


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
    inner = 1 if picked else base.inner_factor(rate, factor)
    asked = list(range(effects.size)) if moves is None else np.flatnonzero(moves).tolist()
    behind = Behind(settings, here, dampers.static(run), inner)
    inputs = base.Inputs.of(layout, rate, here.velocity_m_s, here.current_a, here.temperature_c, run.starts)
    gain = np.ones(run.size)
    for by in here.factors.values():
        gain = gain * by

    def weighed(force: Array, by: int = factor) -> Array:
        return base.in_blocks(force, by, picked=picked)

    bends = _gives_way(settings)
    by_differences = bool(settings[Stage.MOTION]) and not bends
    slopes = base.slope_rows(inputs, layout, t, 1 if bends else inner, gain)
    level_rows: Array | None = None
    if settings[Stage.YIELD] and not by_differences:
        level_rows, _ = base.level_rows(inputs, layout, t, np.ones(run.size), 1 if bends else inner)
    known: dict[int, Array] = {}
    if bends:
        motion = Motion.of(dampers.static(run), here, settings, t.filter)
        changes = changes_of(motion, effects, theta, asked)
        values, known = bent(motion, behind, slopes.static, level_rows, changes)
        slopes = slopes.of(values)
    else:
        if level_rows is not None:
            slopes.static[:] = behind.yielded(slopes.static, level_rows)
        before = slopes.static.copy() if settings[Stage.LIMIT] else None
        behind.filtered(t.filter, slopes.static)
        slopes.add_filter(t, rate, here.yielded_n, here.filtered_n, run.starts)
        if not by_differences:
            slopes = slopes.of(behind.limited_and_measured(slopes.values, before))
    rows = slopes.in_blocks(factor // inner, effects.size, picked=picked)
    own = rows.index.size
    if by_differences:
        rows.values[:own] = dampers.differences(
            run, np.concatenate([layout.pack(t), theta]), rows.index,
            lambda: _differences(run, layout, t, settings, here, weighed, rows.index),
        )  # fmt: skip
    rows.values[own:] = 0.0
    for k, row in known.items():
        rows.values[own + k] = weighed(row, factor // inner)
    rest = [k for k in asked if k not in known]
    _own_slopes(run, dampers, effects, theta, rest, here, weighed, rows.values[own:])
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
        small = away(theta[k], upper[k])
        moved = theta.copy()
        moved[k] += small
        there = dampers.traced(run, effects.settings(moved), here)
        rows[k] = weighed(there.force_n - here.force_n) / small


def _gives_way(settings: Settings) -> bool:
    """Whether the motion's slopes are known: one effect tells them."""
    motion = settings[Stage.MOTION]
    return len(motion) == 1 and motion[0][0].gives_way is not None
