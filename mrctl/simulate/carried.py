"""Many small changes at once through a stage whose slopes are known sample by sample."""

from __future__ import annotations

import numpy as np

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


def heard(by: Array, first: Array, inputs: int = 2) -> tuple[Array, Array]:
    """`by` and `first` without the states that no change moves, or that no output hears of."""
    size = first.shape[1]
    outputs = by.shape[1] - size
    touches = np.any(by != 0.0, axis=0)
    each = touches[outputs:, inputs:] | np.eye(size, dtype=bool)  # state by state
    moved = touches[outputs:, :inputs].any(axis=1) | np.any(first != 0.0, axis=(0, 2))
    told = touches[:outputs, inputs:].any(axis=0)
    for _ in range(size):
        moved, told = each @ moved, each.T @ told
    keep = np.flatnonzero(moved & told)
    if keep.size == size:
        return by, first
    rows = np.concatenate([np.arange(outputs), outputs + keep])
    columns = np.concatenate([np.arange(inputs), inputs + keep])
    return np.ascontiguousarray(by[:, rows[:, None], columns]), np.ascontiguousarray(first[:, keep])
