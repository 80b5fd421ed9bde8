"""Effects beside the base model in one fit: how each record's force, and its slopes, go through them.

The base model's slopes are analytic up to the static force and are then pushed through whatever stages
follow it; the effects' own slopes are differences of the compiled simulation, which repeats only the
stages behind the parameter that moved.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, hysteresis
from mrctl.identify.layout import Layout, Tables
from mrctl.model.damper import Damper, Span
from mrctl.model.effects.base import Effect, Parameter, Settings, Stage, Vector
from mrctl.model.filters import Filter
from mrctl.model.static import static_tables
from mrctl.simulate import Run, Trace, stages, trace

Array = NDArray[np.float64]

SLOPE_STEP = 1e-4  # of a parameter's scale
NEAR = 0.05  # in any parameter: slopes by differences serve that far
PUSH = 1e-4  # of the static force's size, when a slope is pushed through a stage by a difference


@dataclass(frozen=True)
class Effects:
    """The effects of a joint model, and where their parameters stand: scaled to steps that matter."""

    chosen: tuple[Effect, ...]

    @property
    def parameters(self) -> list[tuple[Effect, Parameter]]:
        """All parameters with their effect, in the vector's order."""
        return [(effect, p) for effect in self.chosen for p in effect.parameters]

    @property
    def size(self) -> int:
        """How many parameters there are."""
        return len(self.parameters)

    def pack(self, values: Mapping[str, Sequence[float]]) -> Array:
        """The scaled vector of each effect's parameters; those not named are typical."""
        return np.array(
            [
                x / p.step_scale
                for effect in self.chosen
                for x, p in zip(values.get(effect.name, effect.typical), effect.parameters, strict=True)
            ]
        )

    def unpack(self, theta: Array) -> dict[str, Vector]:
        """Each effect's parameters in SI units, within their bounds whatever rounding did."""
        values: dict[str, Vector] = {}
        at = 0
        for effect in self.chosen:
            part = theta[at : at + len(effect.parameters)]
            values[effect.name] = tuple(
                float(min(max(x * p.step_scale, p.low), p.high))
                for x, p in zip(part, effect.parameters, strict=True)
            )
            at += len(effect.parameters)
        return values

    def settings(self, theta: Array) -> Settings:
        """What the simulation takes."""
        values = self.unpack(theta)
        return {
            stage: [(e, values[e.name]) for e in sorted(self.chosen, key=_rank) if e.stage is stage]
            for stage in Stage
        }

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the scaled vector: the effects' own."""
        known = [p for _, p in self.parameters]
        return (
            np.array([p.low / p.step_scale for p in known]),
            np.array([p.high / p.step_scale for p in known]),
        )

    def free(self) -> NDArray[np.bool_]:
        """Which parameters a fit moves unless told otherwise."""
        return np.array([not p.held for _, p in self.parameters], dtype=bool)


def _rank(effect: Effect) -> tuple[int, str]:
    return effect.rank, effect.name


def bare_damper(layout: Layout, t: Tables, rate_hz: float) -> Damper:
    """What the forward simulation needs: tables and the filter at a rate, no limits, no inverse."""
    g = np.where(layout.velocity_m_s == 0.0, 0.0, t.g)
    static = static_tables(
        layout.current_a.tolist(),
        t.f.tolist(),
        layout.velocity_m_s.tolist(),
        g.tolist(),
        layout.temperature_c.tolist(),
        t.h_off.tolist(),
        t.h_on.tolist(),
        t.off_below_a,
        t.on_above_a,
    )
    none = Filter.of(rate_hz, (1.0,), (1.0,))
    everywhere = Span(-np.inf, np.inf)
    forward = hysteresis.as_filter(t.filter, rate_hz)
    return Damper(static, forward, none, None, np.inf, np.inf, everywhere, everywhere, everywhere)


class Kept:
    """Slopes that are dear, kept while the point at which they were taken is near."""

    def __init__(self) -> None:
        self._of: dict[int, tuple[Run, Array, NDArray[np.intp], Array]] = {}

    def slopes(self, run: Run, at: Array, index: NDArray[np.intp], make: Callable[[], Array]) -> Array:
        """The slopes (m, n) by parameters `index` of a run at a point, made anew where none near are kept."""
        old = self._of.get(id(run))
        if old is not None and old[0] is run and np.array_equal(old[2], index) and _near(old[1], at):
            return old[3]
        made = make()
        self._of[id(run)] = run, at, index, made
        return made


def _near(one: Array, other: Array) -> bool:
    return one.shape == other.shape and float(np.max(np.abs(one - other))) < NEAR


class Dampers:
    """The bare dampers of a set of tables, one for each rate."""

    def __init__(self, layout: Layout, tables: Tables, kept: Kept | None = None) -> None:
        self.layout, self.tables = layout, tables
        self._made: dict[float, Damper] = {}
        self._kept = Kept() if kept is None else kept

    def differences(self, run: Run, at: Array, index: NDArray[np.intp], make: Callable[[], Array]) -> Array:
        """The slopes by the tables' parameters (m, n), which a point nearby may lend."""
        return self._kept.slopes(run, at, index, make)

    def traced(self, run: Run, settings: Settings, like: Trace | None) -> Trace:
        """The run through tables, filter and effects."""
        damper = self._made.get(run.dt_s)
        if damper is None:
            damper = self._made[run.dt_s] = bare_damper(self.layout, self.tables, 1.0 / run.dt_s)
        return trace(run, damper, settings=settings, like=like)


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
    static = base.static_rows(inputs, layout, t, factor, gain, effects.size)
    coarse_rate, dt, starts = rate / factor, factor * run.dt_s, run.starts // factor

    def mean(x: Array) -> Array:
        return np.ascontiguousarray(base.averaged(x, factor))

    u, v, x, level = (
        mean(here.static_n),
        mean(here.velocity_m_s),
        mean(here.displacement_m),
        mean(here.level_n),
    )
    if settings[Stage.YIELD]:
        level_rows, _ = base.level_rows(inputs, layout, t, np.ones(run.size), factor)
        static.static[:] = _pushed(
            static.static,
            level_rows,
            u,
            level,
            lambda f, lev: stages.yielding(settings[Stage.YIELD], f, v, x, lev, dt, starts),
        )
    hysteresis.filter_rows(*hysteresis.discretise(t.filter, coarse_rate), static.static, starts)
    rows = static.with_filter(layout, t, coarse_rate, mean(here.yielded_n), mean(here.filtered_n), starts)
    own = rows.index.size
    values = rows.values[:own]
    if settings[Stage.MOTION]:
        values[:] = dampers.differences(
            run, np.concatenate([layout.pack(t), theta]), rows.index,
            lambda: _differences(run, layout, t, settings, here, factor, rows.index),
        )  # fmt: skip
    elif settings[Stage.LIMIT] or settings[Stage.OUTPUT]:

        def after(force: Array, _: Array) -> Array:
            limited = stages.limited(settings[Stage.LIMIT], force, v, x, dt, starts)
            return stages.measured(settings[Stage.OUTPUT], limited, dt, starts)

        total = mean(here.sum_n)
        values[:] = _pushed(values, np.zeros((0, 0)), total, total, after)
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
