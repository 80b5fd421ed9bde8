"""The model's stages over whole arrays: each takes arrays (n) and gives new ones.

`trace` chains them; an optimiser may call single ones. `chosen` is a stage's effects with their
parameter vectors, as `mrctl.model.effects.registry.in_order` gives them. With none chosen a stage hands
its input on, the same array.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from mrctl.model.effects.base import Effect, Vector
from mrctl.model.filters import Coefficients, Filter, iir_step, settled_state
from mrctl.model.static import StaticTables, force_level
from mrctl.model.tables import interpolate
from mrctl.simulate import loops
from mrctl.simulate.compiled import compiled, run_step
from mrctl.simulate.run import Array

Chosen = Sequence[tuple[Effect, Vector]]


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


def field_current(chosen: Chosen, current_a: Array, dt_s: float) -> Array:
    """The current in A that makes the field."""
    for effect, p in chosen:
        state = _state(effect, p, current_a[0], dt_s)
        current_a = _through(effect, p, state, current_a, dt_s)
    return current_a


def fluid_temperature(
    chosen: Chosen,
    temperature_c: Array,
    velocity_m_s: Array,
    current_a: Array,
    tables: StaticTables,
    dt_s: float,
) -> Array:
    """The fluid's temperature in degC."""
    for effect, p in chosen:
        state = _state(effect, p, temperature_c[0], velocity_m_s[0], current_a[0], tables, dt_s)
        compiled_tables = array_tables(tables)
        temperature_c = _through(
            effect, p, state, temperature_c, velocity_m_s, current_a, compiled_tables, dt_s
        )
    return temperature_c


def piston_motion(
    chosen: Chosen,
    velocity_m_s: Array,
    displacement_m: Array,
    current_a: Array,
    temperature_c: Array,
    tables: StaticTables,
    dt_s: float,
) -> tuple[Array, Array]:
    """The piston's velocity in m/s and displacement in m."""
    for effect, p in chosen:
        inputs = velocity_m_s, displacement_m, current_a, temperature_c
        state = _state(effect, p, *(u[0] for u in inputs), tables, dt_s)
        piston = np.empty_like(velocity_m_s), np.empty_like(velocity_m_s)
        run_step(effect, p, state, *inputs, array_tables(tables), dt_s, *piston)
        velocity_m_s, displacement_m = piston
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
) -> Array:
    """One effect's factor on the static force."""
    inputs = velocity_m_s, displacement_m, current_a, temperature_c
    return _through(effect, p, _state(effect, p, *(u[0] for u in inputs), dt_s), *inputs, dt_s)


def yielding(
    chosen: Chosen, force_n: Array, velocity_m_s: Array, displacement_m: Array, level_n: Array, dt_s: float
) -> Array:
    """The static force in N, elastic before it yields."""
    for effect, p in chosen:
        inputs = force_n, velocity_m_s, displacement_m, level_n
        force_n = _through(effect, p, _state(effect, p, *(u[0] for u in inputs), dt_s), *inputs, dt_s)
    return force_n


def filtered(force_n: Array, c: Coefficients, *, settled: bool) -> Array:
    """H[force]; starting from rest, or from the first force having lasted for ever."""
    out = np.empty_like(force_n)
    state = np.array(settled_state(c, float(force_n[0])) if settled else (0.0, 0.0, 0.0))
    compiled(loops.filtered, iir_step, "filter")(c, state, force_n, out)
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
) -> Array:
    """One effect's force in N."""
    inputs = velocity_m_s, displacement_m, acceleration_m_s2, current_a, temperature_c
    return _through(effect, p, _state(effect, p, *(u[0] for u in inputs), dt_s), *inputs, dt_s)


def limited(chosen: Chosen, force_n: Array, velocity_m_s: Array, displacement_m: Array, dt_s: float) -> Array:
    """The force in N that can build up."""
    for effect, p in chosen:
        inputs = force_n, velocity_m_s, displacement_m
        force_n = _through(effect, p, _state(effect, p, *(u[0] for u in inputs), dt_s), *inputs, dt_s)
    return force_n


def measured(chosen: Chosen, force_n: Array, dt_s: float) -> Array:
    """The force in N as the sensor reports it."""
    for effect, p in chosen:
        force_n = _through(effect, p, _state(effect, p, force_n[0], dt_s), force_n, dt_s)
    return force_n


def _state(effect: Effect, p: Vector, *first: object) -> Array:
    plain = (float(u) if isinstance(u, np.floating) else u for u in first)
    return np.array(effect.initial(p, *plain), dtype=np.float64)


def _through(effect: Effect, p: Vector, state: Array, signal: Array, *rest: object) -> Array:
    out = np.empty_like(signal)
    run_step(effect, p, state, signal, *rest, out)
    return out
