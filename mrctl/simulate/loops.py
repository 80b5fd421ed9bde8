"""One loop a stage: a step over whole arrays of one run. Plain Python; `compiled` makes them fast.

A loop takes what the stage's step takes, its signals as arrays (n), and writes `out` (n); motion
effects write two. The signals may be several stretches, end to end: `starts` (m + 1) is where each begins
and the last one ends, `s` (m, k) each one's state, left as it is after its last sample.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.model.effects.base import Stage, Step
from mrctl.model.filters import Coefficients
from mrctl.model.static import StaticTables

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
P = Sequence[float]
LoopOf = Callable[[Step], Step]


def borrowed(tables: StaticTables) -> StaticTables:
    """The same tables; compiled, they are read without counting references to them at every sample."""
    return tables


def _current(step: Step) -> Step:
    def loop(p: P, s: Array, starts: Ints, current_a: Array, dt_s: float, out: Array) -> None:
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(p, own, current_a[k], dt_s)

    return loop


def _temperature(step: Step) -> Step:
    def loop(
        p: P, s: Array, starts: Ints, temperature_c: Array, velocity_m_s: Array, current_a: Array,
        tables: StaticTables, dt_s: float, out: Array,
    ) -> None:  # fmt: skip
        t = borrowed(tables)
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(p, own, temperature_c[k], velocity_m_s[k], current_a[k], t, dt_s)

    return loop


def _motion(step: Step) -> Step:
    def loop(
        p: P, s: Array, starts: Ints, velocity_m_s: Array, displacement_m: Array, current_a: Array,
        temperature_c: Array, tables: StaticTables, lag: Coefficients, dt_s: float,
        out_v: Array, out_x: Array,
    ) -> None:  # fmt: skip
        t = borrowed(tables)
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                v, x = step(
                    p, own, velocity_m_s[k], displacement_m[k], current_a[k], temperature_c[k], t, lag, dt_s
                )
                out_v[k] = v
                out_x[k] = x

    return loop


def _factor(step: Step) -> Step:
    def loop(
        p: P, s: Array, starts: Ints, velocity_m_s: Array, displacement_m: Array, current_a: Array,
        temperature_c: Array, dt_s: float, out: Array,
    ) -> None:  # fmt: skip
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(
                    p, own, velocity_m_s[k], displacement_m[k], current_a[k], temperature_c[k], dt_s
                )

    return loop


def _yield(step: Step) -> Step:
    def loop(
        p: P, s: Array, starts: Ints, force_n: Array, velocity_m_s: Array, displacement_m: Array,
        level_n: Array, dt_s: float, out: Array,
    ) -> None:  # fmt: skip
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(p, own, force_n[k], velocity_m_s[k], displacement_m[k], level_n[k], dt_s)

    return loop


def _additive(step: Step) -> Step:
    def loop(
        p: P, s: Array, starts: Ints, velocity_m_s: Array, displacement_m: Array, acceleration_m_s2: Array,
        current_a: Array, temperature_c: Array, dt_s: float, out: Array,
    ) -> None:  # fmt: skip
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(
                    p, own, velocity_m_s[k], displacement_m[k], acceleration_m_s2[k], current_a[k],
                    temperature_c[k], dt_s,
                )  # fmt: skip

    return loop


def _limit(step: Step) -> Step:
    def loop(
        p: P,
        s: Array,
        starts: Ints,
        force_n: Array,
        velocity_m_s: Array,
        displacement_m: Array,
        dt_s: float,
        out: Array,
    ) -> None:
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(p, own, force_n[k], velocity_m_s[k], displacement_m[k], dt_s)

    return loop


def _output(step: Step) -> Step:
    def loop(p: P, s: Array, starts: Ints, force_n: Array, dt_s: float, out: Array) -> None:
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(p, own, force_n[k], dt_s)

    return loop


def level(step: Step) -> Step:
    """The loop over `force_level`."""

    def loop(current_a: Array, temperature_c: Array, tables: StaticTables, out: Array) -> None:
        t = borrowed(tables)
        for k in range(out.size):
            out[k] = step(current_a[k], temperature_c[k], t)

    return loop


def table(step: Step) -> Step:
    """The loop over `interpolate`."""

    def loop(x: Array, knots: Array, values: Array, out: Array) -> None:
        for k in range(out.size):
            out[k] = step(x[k], knots, values)

    return loop


def filtered(step: Step) -> Step:
    """The loop over `iir_step`."""

    def loop(c: P, s: Array, starts: Ints, u: Array, out: Array) -> None:
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(c, own, u[k])

    return loop


def gives_way(step: Step) -> Step:
    """The loop over a motion effect's linearisation.

    `static_n` (n) is the change of the static force at a given motion, `force_n` that behind the lag;
    `v` and `x` (n) the change of the motion; `out` (n // factor) that of a force by_force, by_v and by_x (n)
    times static force and motion, averaged.
    """

    def loop(
        p: P, s: Array, starts: Ints, static_n: Array, force_n: Array, damping_n_s_m: Array,
        lag: Coefficients, dt_s: float,
        by_force: Array, by_v: Array, by_x: Array, factor: int, v: Array, x: Array, out: Array,
    ) -> None:  # fmt: skip
        share = 1.0 / factor
        for j in range(starts.size - 1):
            own = s[j]
            for block in range(starts[j] // factor, starts[j + 1] // factor):
                total = 0.0
                for k in range(block * factor, (block + 1) * factor):
                    v[k], x[k] = step(p, own, force_n[k], damping_n_s_m[k], lag, dt_s)
                    total += by_force[k] * static_n[k] + by_v[k] * v[k] + by_x[k] * x[k]
                out[block] = share * total

    return loop


def yield_peaks(step: Step) -> Step:
    """The loop that tells how large each state of a yield effect, in `s` (m, k), becomes: `out` (k)."""

    def loop(
        p: P, s: Array, starts: Ints, force_n: Array, velocity_m_s: Array, displacement_m: Array,
        level_n: Array, dt_s: float, out: Array,
    ) -> None:  # fmt: skip
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                step(p, own, force_n[k], velocity_m_s[k], displacement_m[k], level_n[k], dt_s)
                for i in range(own.size):
                    out[i] = max(out[i], abs(own[i]))

    return loop


def yield_slopes(step: Step) -> Step:
    """The loop over how a yield effect's step moves, by differences along its own path.

    `small` (2 + k) are the differences of force, level and of each of the k states in `s` (m, k);
    `out` (n, 1 + k, 2 + k): how the force, and each state that the step leaves, move with each of them.
    """

    def loop(
        p: P, s: Array, starts: Ints, force_n: Array, velocity_m_s: Array, displacement_m: Array,
        level_n: Array, dt_s: float, small: Array, out: Array,
    ) -> None:  # fmt: skip
        before, there = np.empty(s.shape[1]), np.empty(s.shape[1])
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                v, x, f, level = velocity_m_s[k], displacement_m[k], force_n[k], level_n[k]
                before[:] = own
                here = step(p, own, f, v, x, level, dt_s)
                for c in range(small.size):
                    there[:] = before
                    if c >= 2:
                        there[c - 2] += small[c]
                    by_force, by_level = small[0] * (c == 0), small[1] * (c == 1)
                    moved = step(p, there, f + by_force, v, x, level + by_level, dt_s)
                    out[k, 0, c] = (moved - here) / small[c]
                    for i in range(own.size):
                        out[k, 1 + i, c] = (there[i] - own[i]) / small[c]

    return loop


def carried(step: Step) -> Step:
    """The loop over `linear_step`, for one small change of a stage's inputs, each (n), into `out` (n)."""

    def loop(by: Array, s: Array, starts: Ints, force_n: Array, level_n: Array, out: Array) -> None:
        after = np.empty(s.shape[1])
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(by, own, k, force_n[k], level_n[k], after)
                own[:] = after

    return loop


def linear_step(by: Array, s: Array, k: int, force_n: float, level_n: float, after: Array) -> float:
    """A small change through sample k's slopes, as `yield_slopes` has them; the states' goes to `after`."""
    force: float = by[k, 0, 0] * force_n + by[k, 0, 1] * level_n
    for i in range(s.size):
        force += by[k, 0, 2 + i] * s[i]
        after[i] = by[k, 1 + i, 0] * force_n + by[k, 1 + i, 1] * level_n
        for c in range(s.size):
            after[i] += by[k, 1 + i, 2 + c] * s[c]
    return force


LOOPS: Mapping[Stage, LoopOf] = {
    Stage.CURRENT: _current,
    Stage.TEMPERATURE: _temperature,
    Stage.MOTION: _motion,
    Stage.FACTOR: _factor,
    Stage.YIELD: _yield,
    Stage.ADDITIVE: _additive,
    Stage.LIMIT: _limit,
    Stage.OUTPUT: _output,
}
