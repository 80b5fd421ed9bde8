"""Many small changes at once through a stage whose slopes are known sample by sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.simulate import loops
from mrctl.simulate.compiled import compiled
from mrctl.simulate.run import Array, Ints


def carried(
    by: Array, first: Array, starts: Ints, inputs: Array, beside: Array | None = None, factor: int = 1
) -> Array:
    """The changes of a stage's outputs (o, r, n // factor), averaged over `factor` samples.

    by (n, o + k, 2 + k): how the o outputs and k states move with two inputs and the states; first (m, k, 2):
    the first states of each stretch, by its first inputs; starts (m + 1): where stretches begin, of whole
    blocks. inputs (r, n) and beside (at most r, n): the changes of the two inputs, the second's 0 for the
    rest of the rows.
    """
    if np.any(starts % factor):
        raise ValueError("a stretch begins within a block")
    out = np.empty((by.shape[1] - first.shape[1], inputs.shape[0], inputs.shape[1] // factor))
    loop = compiled(loops.carried, loops.linear_block, "carried")
    contiguous = np.ascontiguousarray(inputs)
    second = np.empty((0, inputs.shape[1])) if beside is None else np.ascontiguousarray(beside)
    loop(by, first, starts, contiguous, second, factor, out)
    return out


def touching(by: Array) -> NDArray[np.bool_]:
    """Which of outputs and states hang on which of inputs and states anywhere (o + k, i + k)."""
    return np.asarray(np.any(by != 0.0, axis=0))


def heard(
    by: Array, first: Array, of: Sequence[int] = (0, 1), touches: NDArray[np.bool_] | None = None
) -> tuple[Array, Array]:
    """`by` and `first` by some of their inputs, without states that these do not move or no output hears of.

    by (n, o + k, i + k), first (m, k, i), of: the places of those inputs; touches: `touching`, where known.
    """
    size, inputs = first.shape[1], first.shape[2]
    outputs = by.shape[1] - size
    there = list(of)
    touches = touching(by) if touches is None else touches
    each = touches[outputs:, inputs:] | np.eye(size, dtype=bool)  # state by state
    moved = touches[outputs:, there].any(axis=1) | np.any(first[:, :, there] != 0.0, axis=(0, 2))
    told = touches[:outputs, inputs:].any(axis=0)
    for _ in range(size):
        moved, told = each @ moved, each.T @ told
    keep = np.flatnonzero(moved & told)
    if keep.size == size and there == list(range(inputs)):
        return by, first
    rows = np.concatenate([np.arange(outputs), outputs + keep])
    columns = np.concatenate([there, inputs + keep])
    known = first[:, keep[:, None], there]
    return np.ascontiguousarray(by[:, rows[:, None], columns]), np.ascontiguousarray(known)
