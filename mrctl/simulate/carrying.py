"""A motion effect that carries all that the piston feels: their loop over whole runs.

As `mrctl.model.beside` on the vehicle, with its functions. Which effects act is not known when the loop is
compiled: they come as pointers to what is compiled once for each of them, so that no combination has to be
compiled for itself.
"""
# ruff: noqa: ARG001 - factors and forces are called alike

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any

import numpy as np
from numba import types
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.np.unsafe import ndarray

from mrctl.errors import InputError
from mrctl.model.beside import FASTER_M_S, HALVINGS, Beside, Pairs, expected, line, turns_early
from mrctl.model.effects.base import Effect, Step, Vector
from mrctl.model.filters import Coefficients
from mrctl.model.static import StaticTables
from mrctl.simulate.compiled import Kernel, blaming, compiled
from mrctl.simulate.loops import P, borrowed
from mrctl.simulate.run import Array, Ints

Steps = tuple[Step, ...]
Pointers = tuple[Steps, Steps, Array, Array, Array, Array]

# At every call, from any thread, numba says that functions as arguments are young.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

_in_order: Any = ndarray.to_fixed_tuple  # which no stub knows
_ROW, _ROWS = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")
_LOOK = types.void(types.int64, _ROWS, _ROWS, _ROWS, *[types.float64] * 6, _ROW)
_GO = types.void(types.int64, _ROWS, _ROWS, *[types.float64] * 6)


def carrying(
    of: tuple[Effect, Vector],
    factors: Pairs,
    acting: Pairs,
    signals: tuple[Array, Array, Array, Array, Array],
    tables: tuple[StaticTables, StaticTables],
    lag: Coefficients,
    dt_s: float,
    starts: Ints,
) -> tuple[Array, Array]:
    """The piston's velocity in m/s and displacement in m behind one motion effect.

    factors, acting: what it carries beside f g h; signals: velocity, displacement, acceleration, current and
    temperature, (n) each; tables: as they are, and as arrays. Raises InputError where a step divides by zero
    or cannot be compiled.
    """
    effect, p = of
    firsts = [[float(u[k]) for u in signals] for k in starts[:-1]]
    try:
        beside = [Beside(factors, acting) for _ in firsts]
        begun = [
            one.look(v, x, a, i, warm, dt_s) for one, (v, x, a, i, warm) in zip(beside, firsts, strict=True)
        ]
        states = [
            effect.initial(p, v, x, i, warm, *held, tables[0], lag, dt_s)
            for (v, x, _, i, warm), held in zip(firsts, begun, strict=True)
        ]
        preloads = np.array([one.preload_n for one in beside])
        pointers = _pointers(factors, acting, [one.states for one in beside])
        out = np.empty_like(signals[0]), np.empty_like(signals[0])
        loop = compiled(_loop, effect.step, f"{effect.name}_carrying")
        with blaming(effect):
            loop(p, np.array(states), starts, *signals, *pointers, preloads, tables[1], lag, dt_s, *out)
    except ArithmeticError as error:
        names = ", ".join(one.name for one, _ in (*factors, *acting))
        raise InputError.at(
            effect.step.__code__.co_filename,
            f"the step of {effect.name} or of what it carries ({names}) fails at some values ({error})",
            "divide by nothing that can be 0",
        ) from error
    return out


def _pointers(factors: Pairs, acting: Pairs, firsts: Sequence[Sequence[Sequence[float]]]) -> Pointers:
    """What looks ahead and what goes on of each of e effects, parameters, first states, room for them twice.

    firsts (m stretches): the first states of each effect. Parameters (e, most), states (m, e, most) and room
    (e, most) are as wide as any effect's: an array of its own for each would have its references counted at
    every call.
    """
    looks, goes = [], []
    for pairs, look, go in ((factors, _factor_ahead, _factor_on), (acting, _force_ahead, _force_on)):
        for effect, p in pairs:
            with blaming(effect):
                looks.append(_alone(look, effect.step, f"{effect.name}_ahead", len(p), _LOOK))
                goes.append(_alone(go, effect.step, f"{effect.name}_on", len(p), _GO))
    vectors = _padded([p for _, p in (*factors, *acting)])
    states = np.array([_padded(one) for one in firsts])
    return tuple(looks), tuple(goes), vectors, states, np.empty(states.shape[1:]), np.empty(states.shape[1:])


def _padded(rows: Sequence[Sequence[float]]) -> Array:
    out = np.zeros((len(rows), max(1, *map(len, rows))))
    for row, values in zip(out, rows, strict=True):
        row[: len(values)] = values
    return out


@cache
def _alone(make: Callable[[int, Step], Step], step: Step, name: str, size: int, signature: object) -> Kernel:
    """What `make` builds around a step of so many parameters, compiled by itself."""
    return compiled(partial(make, size), step, f"{name}_{size}", signature)


def _factor_ahead(size: int, step: Step) -> Step:
    def call(
        m: int, q: Array, now: Array, rooms: Array, v: float, x: float, a: float, i: float, warm: float,
        dt_s: float, felt: Array,
    ) -> None:  # fmt: skip
        s, room = now[m], rooms[m]
        for k in range(s.size):
            room[k] = s[k]
        felt[0] *= step(_in_order(q[m], size), room, v, x, i, warm, dt_s)

    return call


def _factor_on(size: int, step: Step) -> Step:
    def call(
        m: int, q: Array, now: Array, v: float, x: float, a: float, i: float, warm: float, dt_s: float
    ) -> None:
        step(_in_order(q[m], size), now[m], v, x, i, warm, dt_s)

    return call


def _force_ahead(size: int, step: Step) -> Step:
    faster = FASTER_M_S

    def call(
        m: int, q: Array, now: Array, rooms: Array, v: float, x: float, a: float, i: float, warm: float,
        dt_s: float, felt: Array,
    ) -> None:  # fmt: skip
        p, s, room = _in_order(q[m], size), now[m], rooms[m]
        for k in range(s.size):
            room[k] = s[k]
        felt[1] += step(p, room, v, x, a, i, warm, dt_s)
        for k in range(s.size):
            room[k] = s[k]
        felt[2] += step(p, room, v + faster, x + faster * dt_s, a, i, warm, dt_s)

    return call


def _force_on(size: int, step: Step) -> Step:
    def call(
        m: int, q: Array, now: Array, v: float, x: float, a: float, i: float, warm: float, dt_s: float
    ) -> None:
        step(_in_order(q[m], size), now[m], v, x, a, i, warm, dt_s)

    return call


def _loop(step: Step) -> Step:
    # Compiled code finds what a loop is built around, not what stands beside it.
    near, through, early, feel = expected, line, turns_early, _felt
    faster, halvings = FASTER_M_S, HALVINGS

    def loop(
        p: P, s: Array, starts: Ints, velocity_m_s: Array, displacement_m: Array, acceleration_m_s2: Array,
        current_a: Array, temperature_c: Array, looks: Steps, goes: Steps, q: Array, first: Array,
        now: Array, room: Array, preload_n: Array, tables: StaticTables, lag: Coefficients, dt_s: float,
        out_v: Array, out_x: Array,
    ) -> None:  # fmt: skip
        t = borrowed(tables)
        felt = np.empty(3)  # factor, force, and force a little faster
        own, trial = np.empty(s.shape[1]), np.empty(s.shape[1])
        for j in range(starts.size - 1):
            own[:] = s[j]
            now[:] = first[j]
            given_m_s, given_m = 0.0, 0.0
            for k in range(starts[j], starts[j + 1]):
                v, x, a = velocity_m_s[k], displacement_m[k], acceleration_m_s2[k]
                i, warm = current_a[k], temperature_c[k]
                v0, x0 = near(v, x, given_m_s, given_m, dt_s)
                feel(looks, q, now, room, preload_n[j], v0, x0, 0.0, a, i, warm, dt_s, felt)
                factor = felt[0]
                force, slope = through(felt[1], felt[2], v0, faster)
                trial[:] = own
                v1, x1 = step(p, trial, v, x, i, warm, factor, force, slope, t, lag, dt_s)
                if v0 * v1 < 0.0:
                    by_line = force + slope * v1
                    feel(looks, q, now, room, preload_n[j], v0, x0, v1 - v0, a, i, warm, dt_s, felt)
                    if early(v0, v1, felt[1] - by_line, by_line):
                        low, high = min(v0, v1), max(v0, v1)
                        for _ in range(halvings):
                            middle = 0.5 * (low + high)
                            feel(
                                looks, q, now, room, preload_n[j], v0, x0, middle - v0, a, i, warm, dt_s, felt
                            )
                            trial[:] = own
                            v1, x1 = step(p, trial, v, x, i, warm, factor, felt[1], 0.0, t, lag, dt_s)
                            if v1 > middle:
                                low = middle
                            else:
                                high = middle
                        feel(looks, q, now, room, preload_n[j], v0, x0, low - v0, a, i, warm, dt_s, felt)
                        slow = felt[1]
                        feel(looks, q, now, room, preload_n[j], v0, x0, high - v0, a, i, warm, dt_s, felt)
                        force, slope = through(slow, felt[1], low, high - low)
                        trial[:] = own
                        v1, x1 = step(p, trial, v, x, i, warm, factor, force, slope, t, lag, dt_s)
                own[:] = trial
                for m in range(len(goes)):
                    goes[m](m, q, now, v1, x1, a, i, warm, dt_s)
                given_m_s, given_m = v - v1, x - x1
                out_v[k] = v1
                out_x[k] = x1

    return loop


def _felt(
    looks: Steps, q: Array, now: Array, room: Array, preload_n: float, v: float, x: float, more: float,
    a: float, i: float, warm: float, dt_s: float, felt: Array,
) -> None:  # fmt: skip
    felt[0], felt[1], felt[2] = 1.0, -preload_n, -preload_n
    for m in range(len(looks)):
        looks[m](m, q, now, room, v + more, x + more * dt_s, a, i, warm, dt_s, felt)
