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

LANES = 8  # changes that go through a step side by side: `linear_step` names each of them


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
                    p, own, velocity_m_s[k], displacement_m[k], current_a[k], temperature_c[k], 1.0,
                    0.0, 0.0, t, lag, dt_s,
                )  # fmt: skip
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


def _bent(step: Step) -> Step:
    def loop(
        p: P, s: Array, starts: Ints, force_n: Array, velocity_m_s: Array, displacement_m: Array,
        beside: Array, dt_s: float, out: Array,
    ) -> None:  # fmt: skip
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(p, own, force_n[k], velocity_m_s[k], displacement_m[k], beside[k], dt_s)

    return loop


def _limited(step: Step) -> Step:
    def loop(
        p: P, s: Array, starts: Ints, force_n: Array, velocity_m_s: Array, displacement_m: Array,
        temperature_c: Array, static_n: Array, level_n: Array, tables: StaticTables, dt_s: float, out: Array,
    ) -> None:  # fmt: skip
        t = borrowed(tables)
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(
                    p, own, force_n[k], velocity_m_s[k], displacement_m[k], temperature_c[k], static_n[k],
                    level_n[k], t, dt_s,
                )  # fmt: skip

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


def way_slopes(step: Step) -> Step:
    """The loop over how a motion effect's linearisation moves, by force and states, along a run.

    `damping_n_s_m`, `stiffness_n_m`, `given_m` (n); `out` (n, 2 + k, 1 + k): how the piston's velocity and
    displacement, and each of the k states that the step leaves, move with the force and with each state.
    """

    def loop(
        p: P, damping_n_s_m: Array, stiffness_n_m: Array, given_m: Array, lag: Coefficients, dt_s: float,
        out: Array,
    ) -> None:  # fmt: skip
        s = np.empty(out.shape[1] - 2)
        for k in range(out.shape[0]):
            for c in range(out.shape[2]):
                for i in range(s.size):
                    s[i] = 1.0 if c == 1 + i else 0.0
                force = 1.0 if c == 0 else 0.0
                v, x = step(p, s, force, damping_n_s_m[k], stiffness_n_m[k], given_m[k], lag, dt_s)
                out[k, 0, c] = v
                out[k, 1, c] = x
                for i in range(s.size):
                    out[k, 2 + i, c] = s[i]

    return loop


def bears(step: Step) -> Step:
    """The loop over the force that a motion effect hangs on, along a given motion (n); `s` (m, k)."""

    def loop(
        p: P, s: Array, starts: Ints, given_m: Array, given_m_s: Array, dt_s: float, out: Array
    ) -> None:  # fmt: skip
        for j in range(starts.size - 1):
            own, before = s[j], given_m[starts[j]]
            for k in range(starts[j], starts[j + 1]):
                out[k] = step(p, own, before, given_m[k], given_m_s[k], dt_s)
                before = given_m[k]

    return loop


def peaks(call: Step) -> Step:
    """The loop that tells how large each state of a step, in `s` (m, k), becomes: `out` (k).

    `call` is one of CALLS, `signals` (q, n) what it takes.
    """

    def loop(
        p: P, s: Array, starts: Ints, signals: Array, tables: StaticTables, dt_s: float, out: Array
    ) -> None:  # fmt: skip
        t = borrowed(tables)
        u = np.empty(signals.shape[0])
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                for q in range(u.size):
                    u[q] = signals[q, k]
                call(p, own, u, t, dt_s)
                for i in range(own.size):
                    out[i] = max(out[i], abs(own[i]))

    return loop


def slopes(call: Step) -> Step:
    """The loop over how a step moves, by differences along its own path.

    `call` is one of CALLS, `signals` (q, n) what it takes. `small` (w + k) are the differences of the
    signals `of` (w) and of k of the states in `s` (m, r), those `asked` for (k); `out` (n, 1 + k, w + k): how
    the step's force, and each of those states that it leaves, move with each of them.
    """

    def loop(
        p: P, s: Array, starts: Ints, signals: Array, tables: StaticTables, dt_s: float, of: Ints,
        asked: Ints, small: Array, out: Array,
    ) -> None:  # fmt: skip
        t = borrowed(tables)
        before, there = np.empty(s.shape[1]), np.empty(s.shape[1])
        u = np.empty(signals.shape[0])
        for j in range(starts.size - 1):
            own = s[j]
            for k in range(starts[j], starts[j + 1]):
                for q in range(u.size):
                    u[q] = signals[q, k]
                before[:] = own
                here = call(p, own, u, t, dt_s)
                for c in range(small.size):
                    there[:] = before
                    if c < of.size:
                        u[of[c]] += small[c]
                    else:
                        there[asked[c - of.size]] += small[c]
                    moved = call(p, there, u, t, dt_s)
                    if c < of.size:
                        u[of[c]] = signals[of[c], k]
                    out[k, 0, c] = (moved - here) / small[c]
                    for i in range(asked.size):
                        out[k, 1 + i, c] = (there[asked[i]] - own[asked[i]]) / small[c]

    return loop


def carried(step: Step) -> Step:
    """The loop over `linear_block`, for many small changes of two inputs, LANES of them side by side.

    `by` (n, o + k, 2 + k): how o outputs and k states move with the inputs and the states; `first`
    (m, k, 2): the first states, by the first inputs. `inputs` (r, n) and `beside` (at most r, n), which is
    0 where there are no more; `out` (o, r, n // factor): the outputs, averaged.
    """

    def loop(
        by: Array, first: Array, starts: Ints, inputs: Array, beside: Array, factor: int, out: Array
    ) -> None:
        outputs, rows, states = out.shape[0], out.shape[1], first.shape[1]
        x, y = np.zeros((2 + states, LANES)), np.zeros((outputs + states, LANES))
        total = np.zeros((outputs, LANES))
        for m in range(0, rows, LANES):
            x[1] = 0.0
            for j in range(starts.size - 1):
                gathered(inputs, beside, m, starts[j], x)
                for i in range(states):
                    x[2 + i] = first[j, i, 0] * x[0] + first[j, i, 1] * x[1]
                for block in range(starts[j] // factor, starts[j + 1] // factor):
                    step(by, inputs, beside, m, block, factor, x, y, total)
                    for o in range(outputs):
                        for r in range(min(LANES, rows - m)):
                            out[o, m + r, block] = total[o, r]

    return loop


def linear_block(
    by: Array, inputs: Array, beside: Array, m: int, block: int, factor: int,
    x: Array, y: Array, total: Array,
) -> None:  # fmt: skip
    """The mean outputs, into `total` (o, LANES), of LANES changes from the row m on over a block of samples.

    `by`, `inputs` and `beside` as `carried` has them; `x` (2 + k, LANES) keeps the states, from its third
    row on; `y` (o + k, LANES) is room for what a sample gives.
    """
    outputs = total.shape[0]
    share = 1.0 / factor
    total[:] = 0.0
    for k in range(block * factor, (block + 1) * factor):
        gathered(inputs, beside, m, k, x)
        linear_step(by, k, x, y)
        for o in range(outputs):
            for r in range(LANES):
                total[o, r] += share * y[o, r]
        for i in range(outputs, y.shape[0]):
            for r in range(LANES):
                x[2 + i - outputs, r] = y[i, r]


def linear_step(by: Array, k: int, x: Array, y: Array) -> None:
    """Small changes x (c, LANES) through the slopes of sample k, to y (o, LANES)."""
    for o in range(y.shape[0]):
        # One by one, they stay in the processor's wide registers; a loop over them would go by way of y.
        a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = 0.0
        for c in range(x.shape[0]):
            slope = by[k, o, c]
            if slope != 0.0:  # many are 0
                a0 += slope * x[c, 0]
                a1 += slope * x[c, 1]
                a2 += slope * x[c, 2]
                a3 += slope * x[c, 3]
                a4 += slope * x[c, 4]
                a5 += slope * x[c, 5]
                a6 += slope * x[c, 6]
                a7 += slope * x[c, 7]
        y[o, 0], y[o, 1], y[o, 2], y[o, 3] = a0, a1, a2, a3
        y[o, 4], y[o, 5], y[o, 6], y[o, 7] = a4, a5, a6, a7


def gathered(inputs: Array, beside: Array, m: int, k: int, x: Array) -> None:
    """Sample k of the rows from m on, the last one in place of those that there are not."""
    last = inputs.shape[0] - 1
    for r in range(LANES):
        x[0, r] = inputs[min(m + r, last), k]
    for r in range(min(LANES, beside.shape[0] - m)):
        x[1, r] = beside[m + r, k]


LOOPS: Mapping[Stage, LoopOf] = {
    Stage.CURRENT: _current,
    Stage.TEMPERATURE: _temperature,
    Stage.MOTION: _motion,
    Stage.FACTOR: _factor,
    Stage.YIELD: _bent,
    Stage.ADDITIVE: _additive,
    Stage.LIMIT: _limited,
    Stage.ROD: _additive,
    Stage.OUTPUT: _output,
}


def _of_bent(step: Step) -> Step:
    def call(p: P, s: Array, u: Array, tables: StaticTables, dt_s: float) -> float:  # noqa: ARG001 - as all
        force: float = step(p, s, u[0], u[1], u[2], u[3], dt_s)
        return force

    return call


def _of_limited(step: Step) -> Step:
    def call(p: P, s: Array, u: Array, tables: StaticTables, dt_s: float) -> float:
        force: float = step(p, s, u[0], u[1], u[2], u[3], u[4], u[5], tables, dt_s)
        return force

    return call


def _of_additive(step: Step) -> Step:
    def call(p: P, s: Array, u: Array, tables: StaticTables, dt_s: float) -> float:  # noqa: ARG001 - as all
        force: float = step(p, s, u[0], u[1], u[2], u[3], u[4], dt_s)
        return force

    return call


# A step as one that takes its signals, in its own order, as an array.
CALLS: Mapping[Stage, LoopOf] = {
    Stage.YIELD: _of_bent,
    Stage.ADDITIVE: _of_additive,
    Stage.LIMIT: _of_limited,
    Stage.ROD: _of_additive,
}
