"""How a motion that gives way to a force moves when it feels others too, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrctl.model.effects.base import Step
from mrctl.simulate.compiled import compiled
from mrctl.simulate.run import Array, Ints


def joined(way: Array, first: Array, acting: Sequence[Sequence[Array]]) -> tuple[Array, Array]:
    """The way of a motion that gives way to what acts beside the static force too, and its first states.

    way (n, 2 + k, 1 + k): how the piston's velocity, displacement and k states move with a force and the
    states; first (m, k, 1): the first ones; acting: groups, and of each how its forces beside it (n, 1 + j,
    2 + j) and their j states move with that velocity, displacement and the states, which come behind the k.
    Behind velocity and displacement comes each group's force.
    """
    forces = [one for group in acting for one in group]
    if not forces:
        return way, first
    n, own = way.shape[0], way.shape[2]
    groups = np.repeat(np.arange(len(acting)), [len(group) for group in acting])
    ends = np.cumsum([own, *(one.shape[2] - 2 for one in forces)])
    columns, more = int(ends[-1]), int(ends[-1]) - own
    # All by the force, the k states and the others' j; what acts by velocity and displacement before these.
    ways = np.zeros((n, 1 + own, columns))
    ways[:, :, :own] = way
    by_force, after = np.zeros((n, len(forces), 2 + columns)), np.zeros((n, more, 2 + columns))
    for number, (one, begin, end) in enumerate(zip(forces, ends[:-1], ends[1:], strict=True)):
        rows, there = slice(begin - own, end - own), slice(2 + begin, 2 + end)
        by_force[:, number, :2], by_force[:, number, there] = one[:, 0, :2], one[:, 0, 2:]
        after[:, rows, :2], after[:, rows, there] = one[:, 1:, :2], one[:, 1:, 2:]
    out = np.empty((n, 1 + columns + len(acting), columns))
    compiled(_each, _joined, "joined_ways")(ways, by_force, after, groups, out)
    return out, np.pad(first, ((0, 0), (0, more), (0, 0)))


def _each(step: Step) -> Step:
    def loop(way: Array, forces: Array, after: Array, groups: Ints, out: Array) -> None:
        for k in range(out.shape[0]):
            step(way[k], forces[k], after[k], groups, out[k])

    return loop


def _joined(way: Array, forces: Array, after: Array, groups: Ints, out: Array) -> None:
    """One sample: way (2 + k, c), forces (e, 2 + c) and after (j, 2 + c), to out (2 + sums + k + j, c)."""
    own, sums = way.shape[0], out.shape[0] - way.shape[0] - after.shape[0]
    by_v, by_x = 0.0, 0.0
    for e in range(forces.shape[0]):
        by_v += forces[e, 0]
        by_x += forces[e, 1]
    by_v = max(by_v, 0.0)
    rest = 1.0 - by_v * way[0, 0] - by_x * way[1, 0]
    for c in range(way.shape[1]):
        # The whole force, of which these make a part by the motion that it makes.
        whole = by_v * way[0, c] + by_x * way[1, c] if c else 1.0
        for e in range(forces.shape[0]):
            whole += forces[e, 2 + c]
        for r in range(own):
            moved = way[r, 0] * whole / rest + (way[r, c] if c else 0.0)
            out[r if r < 2 else r + sums, c] = moved
        v, x = out[0, c], out[1, c]
        out[2 : 2 + sums, c] = 0.0
        for e in range(forces.shape[0]):
            out[2 + groups[e], c] += forces[e, 0] * v + forces[e, 1] * x + forces[e, 2 + c]
        for r in range(after.shape[0]):
            out[own + sums + r, c] = after[r, 0] * v + after[r, 1] * x + after[r, 2 + c]
