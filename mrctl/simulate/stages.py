"""The model's stages over whole arrays: each takes arrays (n) and gives new ones.

`trace` chains them; an optimiser may call single ones. `chosen` is a stage's effects with their
parameter vectors, as `mrctl.model.effects.registry.in_order` gives them. With none chosen a stage hands
its input on, the same array.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from mrctl.model.beside import ALONE
from mrctl.model.effects.base import Effect, Vector
from mrctl.model.filters import Coefficients, Filter, iir_step, settled_state
from mrctl.model.static import StaticTables, force_level
from mrctl.model.tables import interpolate
from mrctl.simulate import loops
from mrctl.simulate.carrying import carrying
from mrctl.simulate.compiled import compiled, divided, run_step
from mrctl.simulate.run import Array, Ints, whole

Chosen = Sequence[tuple[Effect, Vector]]
LONG_S = 1e6  # in which all but a field forgets


@lru_cache(maxsize=64)
def array_tables(tables: StaticTables) -> StaticTables:
    """The tables with arrays (k) in place of tuples, for compiled code."""
    return StaticTables._make(
        value if isinstance(value, float) else np.asarray(value, dtype=np.float64) for value in tables
    )


@lru_cache(maxsize=64)
def coefficients_at(h: Filter, dt_s: float) -> Coefficients:
    """The filter's coefficients at this step. Raises FilterError where it cannot be carried there."""
    return h.resampled(1.0 / dt_s).coefficients


def field_current(
    chosen: Chosen,
    current_a: Array,
    dt_s: float,
    starts: Ints | None = None,
    before_a: Array | None = None,
) -> Array:
    """The current in A that makes the field; before_a (stretches): from which the first one was reached."""
    begins = whole(current_a.size) if starts is None else starts
    before = np.zeros(begins.size - 1) if before_a is None else before_a
    for effect, p in chosen:
        states = _begun(effect, p, begins, (current_a,), (dt_s,))
        for k in np.flatnonzero(before):
            state = effect.initial(p, float(before[k]), dt_s)
            effect.step(p, state, float(current_a[begins[k]]), LONG_S)
            states[k] = state
        (current_a,) = _run(effect, p, begins, (current_a,), (dt_s,), 1, states)
    return current_a


def fluid_temperature(
    chosen: Chosen,
    temperature_c: Array,
    velocity_m_s: Array,
    current_a: Array,
    tables: StaticTables,
    dt_s: float,
    starts: Ints | None = None,
    warmer_k: Array | None = None,
) -> Array:
    """The fluid's temperature in degC; warmer_k (stretches): than the effect says, it is at the start."""
    begins = whole(temperature_c.size) if starts is None else starts
    for effect, p in chosen:
        inputs = temperature_c, velocity_m_s, current_a
        states = _begun(effect, p, begins, inputs, (tables, dt_s))
        if warmer_k is not None and states.shape[1]:
            states[:, 0] += warmer_k
        (temperature_c,) = _run(effect, p, begins, inputs, (tables, dt_s), 1, states)
    return temperature_c


def piston_motion(
    chosen: Chosen,
    velocity_m_s: Array,
    displacement_m: Array,
    current_a: Array,
    temperature_c: Array,
    tables: StaticTables,
    lag: Coefficients,
    dt_s: float,
    starts: Ints | None = None,
    acceleration_m_s2: Array | None = None,
    factors: Chosen = (),
    acting: Chosen = (),
) -> tuple[Array, Array]:
    """The piston's velocity in m/s and displacement in m.

    factors, acting: the factor effects, and the additive and rod effects, which the last motion effect
    carries; with an acceleration (n).
    """
    begins = whole(velocity_m_s.size) if starts is None else starts
    rest = tables, lag, dt_s
    last = chosen[-1:] if (factors or acting) and acceleration_m_s2 is not None else ()
    for effect, p in chosen[: len(chosen) - len(last)]:
        inputs = velocity_m_s, displacement_m, current_a, temperature_c
        states = _begun(effect, p, begins, inputs, (*ALONE, *rest))
        velocity_m_s, displacement_m = _run(effect, p, begins, inputs, rest, 2, states)
    if last and acceleration_m_s2 is not None:
        signals = velocity_m_s, displacement_m, acceleration_m_s2, current_a, temperature_c
        both = tables, array_tables(tables)
        return carrying(last[0], factors, acting, signals, both, lag, dt_s, begins)
    return velocity_m_s, displacement_m


def level(current_a: Array, temperature_c: Array, tables: StaticTables) -> Array:
    """f(i) h(i, T) in N."""
    out = np.empty_like(current_a)
    compiled(loops.level, force_level, "level")(current_a, temperature_c, array_tables(tables), out)
    return out


def shape(velocity_m_s: Array, tables: StaticTables) -> Array:
    """g(v)."""
    t, out = array_tables(tables), np.empty_like(velocity_m_s)
    compiled(loops.table, interpolate, "table")(velocity_m_s, t.velocity_m_s, t.shape, out)
    return out


def factor(
    effect: Effect,
    p: Vector,
    velocity_m_s: Array,
    displacement_m: Array,
    current_a: Array,
    temperature_c: Array,
    dt_s: float,
    starts: Ints | None = None,
) -> Array:
    """One effect's factor on the static force."""
    inputs = velocity_m_s, displacement_m, current_a, temperature_c
    return _through(effect, p, starts, inputs, (dt_s,))


def yielding(
    chosen: Chosen,
    force_n: Array,
    velocity_m_s: Array,
    displacement_m: Array,
    level_n: Array,
    dt_s: float,
    starts: Ints | None = None,
) -> Array:
    """The static force in N, elastic before it yields."""
    for effect, p in chosen:
        inputs = force_n, velocity_m_s, displacement_m, level_n
        force_n = _through(effect, p, starts, inputs, (dt_s,))
    return force_n


def filtered(force_n: Array, c: Coefficients, *, settled: bool, starts: Ints | None = None) -> Array:
    """H[force]; starting from rest, or from the first force having lasted for ever."""
    out = np.empty_like(force_n)
    starts = whole(force_n.size) if starts is None else starts
    firsts = force_n[starts[:-1]].tolist()
    states = np.array([settled_state(c, first) if settled else (0.0, 0.0, 0.0) for first in firsts])
    compiled(loops.filtered, iir_step, "filter")(c, states, starts, force_n, out)
    return out


def additive(
    effect: Effect,
    p: Vector,
    velocity_m_s: Array,
    displacement_m: Array,
    acceleration_m_s2: Array,
    current_a: Array,
    temperature_c: Array,
    dt_s: float,
    starts: Ints | None = None,
) -> Array:
    """One effect's force in N."""
    inputs = velocity_m_s, displacement_m, acceleration_m_s2, current_a, temperature_c
    return _through(effect, p, starts, inputs, (dt_s,))


def limited(
    chosen: Chosen,
    force_n: Array,
    velocity_m_s: Array,
    displacement_m: Array,
    temperature_c: Array,
    static_n: Array,
    level_n: Array,
    tables: StaticTables,
    dt_s: float,
    starts: Ints | None = None,
) -> Array:
    """The force in N that can build up in the fluid."""
    for effect, p in chosen:
        inputs = force_n, velocity_m_s, displacement_m, temperature_c, static_n, level_n
        force_n = _through(effect, p, starts, inputs, (tables, dt_s))
    return force_n


def measured(chosen: Chosen, force_n: Array, dt_s: float, starts: Ints | None = None) -> Array:
    """The force in N as the sensor reports it."""
    for effect, p in chosen:
        force_n = _through(effect, p, starts, (force_n,), (dt_s,))
    return force_n


def _through(
    effect: Effect, p: Vector, starts: Ints | None, inputs: Sequence[Array], rest: tuple[object, ...]
) -> Array:
    """The effect's step over its inputs, each (n)."""
    return _run(effect, p, starts, inputs, rest, 1)[0]


def _run(
    effect: Effect,
    p: Vector,
    starts: Ints | None,
    inputs: Sequence[Array],
    rest: tuple[object, ...],
    outputs: int,
    states: Array | None = None,
) -> list[Array]:
    """The effect's step over its inputs, each (n), every stretch from its own initial state."""
    starts = whole(inputs[0].size) if starts is None else starts
    states = _begun(effect, p, starts, inputs, rest) if states is None else states
    constants = (array_tables(x) if isinstance(x, StaticTables) else x for x in rest)
    out = [np.empty_like(inputs[0]) for _ in range(outputs)]
    run_step(effect, p, states, starts, *inputs, *constants, *out)
    return out


def _begun(
    effect: Effect, p: Vector, starts: Ints, inputs: Sequence[Array], rest: tuple[object, ...]
) -> Array:
    """The effect's state at the first sample of each stretch, that having lasted for ever."""
    firsts = zip(*(u[starts[:-1]].tolist() for u in inputs), strict=True)
    try:
        return np.array([effect.initial(p, *first, *rest) for first in firsts], dtype=np.float64)
    except ArithmeticError as error:
        raise divided(effect, error) from error
