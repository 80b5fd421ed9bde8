"""A whole run through the damper, every stage kept, so that the next one costs only what changed.

An optimiser that moves one parameter hands the trace it already has to `trace` as `like`: every stage
whose effects and inputs are the same is taken over, and the work starts at the first that is not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mrctl.model.beside import felt
from mrctl.model.damper import Damper
from mrctl.model.effects.base import EffectError, Settings, Stage
from mrctl.model.effects.registry import of_damper
from mrctl.model.filters import plain_lag
from mrctl.model.static import StaticTables
from mrctl.simulate import stages
from mrctl.simulate.run import Array, Run

Made = Mapping[object, tuple[object, Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """What every stage gave, each (n); a stage without effects shares its input's array."""

    run: Run
    settled: bool
    current_a: Array
    temperature_c: Array
    velocity_m_s: Array
    displacement_m: Array
    level_n: Array  # f(i1) h(i1, T1)
    shape: Array  # g(v1)
    factors: Mapping[str, Array]
    static_n: Array  # level, shape and factors multiplied
    yielded_n: Array
    filtered_n: Array
    additive_n: Mapping[str, Array]
    sum_n: Array
    limited_n: Array
    rod_n: Mapping[str, Array]
    whole_n: Array  # what the fluid and the rod's other forces come to
    force_n: Array
    made: Made  # by stage: what it was made from, and what came out


class _Maker:
    """Makes a stage's result, or takes it over from an earlier trace where nothing behind it differs."""

    def __init__(self, earlier: Made) -> None:
        self._earlier = earlier
        self.made: dict[object, tuple[object, Any]] = {}

    def __call__(self, name: object, source: tuple[object, ...], make: Callable[[], Any]) -> Any:  # noqa: ANN401
        # Arrays are told apart by identity: none is ever changed, and the trace keeps them alive.
        key = tuple(id(part) if isinstance(part, np.ndarray) else part for part in source)
        before = self._earlier.get(name)
        value = before[1] if before is not None and before[0] == key else make()
        self.made[name] = key, value
        return value


def trace(
    run: Run,
    damper: Damper,
    *,
    settings: Settings | None = None,
    like: Trace | None = None,
    settled: bool = True,
) -> Trace:
    """The run through the damper, stage by stage.

    settings: effects in place of the damper's own, by stage, in order; not checked against bounds.
    like: an earlier trace of the same run, whose unchanged stages are taken over.
    settled: start as if the first sample had lasted for ever; else with H at rest, as a daemon starts.
    Raises EffectError for unsound effects, or one that needs a displacement the run does not have.
    """
    chosen = settings if settings is not None else of_damper(damper)
    _check_needs(chosen, run)
    by = {stage: tuple(chosen.get(stage, ())) for stage in Stage}
    make = _Maker(like.made if like is not None and like.run is run and like.settled == settled else {})
    t, dt, a, starts = damper.static, run.dt_s, run.acceleration_m_s2, run.starts
    c = stages.coefficients_at(damper.forward_filter, dt)
    lag = plain_lag(c)

    ce, te, me = by[Stage.CURRENT], by[Stage.TEMPERATURE], by[Stage.MOTION]
    # A stage without effects hands its input on.
    i = run.current_a
    if ce:
        i = make(
            Stage.CURRENT, (ce,), lambda: stages.field_current(ce, run.current_a, dt, starts, run.before_a)
        )
    warm = run.temperature_c
    if te:
        warm = make(
            Stage.TEMPERATURE,
            (te, i, t),
            lambda: stages.fluid_temperature(
                te, run.temperature_c, run.velocity_m_s, i, t, dt, starts, run.warmer_k
            ),
        )
    v, x = run.velocity_m_s, run.displacement_m
    if me:
        factors_felt, acting = felt(by)
        v, x = make(
            Stage.MOTION,
            (me, i, warm, t, lag, *factors_felt, *acting),
            lambda: stages.piston_motion(
                me, run.velocity_m_s, run.displacement_m, i, warm, t, lag, dt, starts, a, factors_felt, acting
            ),
        )
    level = make("level", (i, warm, _level_tables(t)), lambda: stages.level(i, warm, t))
    shape = make("shape", (v, t.velocity_m_s, t.shape), lambda: stages.shape(v, t))
    factors = {
        e.name: make(
            (e.name, Stage.FACTOR),
            (e, p, v, x, i, warm),
            partial(stages.factor, e, p, v, x, i, warm, dt, starts),
        )
        for e, p in by[Stage.FACTOR]
    }
    static = make(
        "static", (level, shape, *factors.values()), lambda: _product([level, shape, *factors.values()])
    )
    ye, le, oe = by[Stage.YIELD], by[Stage.LIMIT], by[Stage.OUTPUT]
    yielded = static
    if ye:
        yielded = make(
            Stage.YIELD,
            (ye, static, v, x, level),
            lambda: stages.yielding(ye, static, v, x, level, dt, starts),
        )
    filtered = make(
        "filter", (yielded, c), lambda: stages.filtered(yielded, c, settled=settled, starts=starts)
    )
    additive, rod = (
        {
            e.name: make(
                (e.name, stage),
                (e, p, v, x, a, i, warm),
                partial(stages.additive, e, p, v, x, a, i, warm, dt, starts),
            )
            for e, p in by[stage]
        }
        for stage in (Stage.ADDITIVE, Stage.ROD)
    )
    total = filtered
    if additive:
        total = make("sum", (filtered, *additive.values()), lambda: _sum([filtered, *additive.values()]))
    limited = total
    if le:
        limited = make(
            Stage.LIMIT,
            (le, total, v, x, warm, yielded, level, t.velocity_m_s, t.shape),
            lambda: stages.limited(le, total, v, x, warm, yielded, level, t, dt, starts),
        )
    whole = limited
    if rod:
        whole = make("whole", (limited, *rod.values()), lambda: _sum([limited, *rod.values()]))
    force = whole
    if oe:
        force = make(Stage.OUTPUT, (oe, whole), lambda: stages.measured(oe, whole, dt, starts))
    return Trace(
        run, settled, i, warm, v, x, level, shape, factors, static, yielded, filtered, additive, total,
        limited, rod, whole, force, make.made,
    )  # fmt: skip


def simulate(
    damper: Damper,
    dt_s: float,
    velocity_m_s: ArrayLike,
    current_a: ArrayLike,
    temperature_c: ArrayLike,
    displacement_m: ArrayLike | None = None,
    acceleration_m_s2: ArrayLike | None = None,
    *,
    settled: bool = True,
) -> Array:
    """The force in N (n) of a damper with its effects; signals as `Run.of` and start as `trace` have them."""
    run = Run.of(dt_s, velocity_m_s, current_a, temperature_c, displacement_m, acceleration_m_s2)
    return trace(run, damper, settled=settled).force_n


def _check_needs(chosen: Settings, run: Run) -> None:
    if not run.has_displacement:
        blind = [e.name for effects in chosen.values() for e, _ in effects if "displacement" in e.needs]
        if blind:
            raise EffectError(f"{', '.join(blind)} needs the displacement, which this run does not have")


def _level_tables(t: StaticTables) -> tuple[object, ...]:
    return t.current_a, t.force_n, t.temperature_c, t.h_off, t.h_on, t.off_below_a, t.on_above_a


def _product(arrays: list[Array]) -> Array:
    out = arrays[0] * arrays[1]
    for factor in arrays[2:]:
        out *= factor
    return out


def _sum(arrays: list[Array]) -> Array:
    out = arrays[0] + arrays[1]
    for force in arrays[2:]:
        out += force
    return out
