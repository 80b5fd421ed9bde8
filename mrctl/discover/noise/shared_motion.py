"""What a model leaves in runs of one motion alike: noise does not, and physics without a name may."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Pair = tuple[int, int]

ONE_MOTION = 0.1  # of the velocity in RMS, that two runs of one motion may differ by: their sensors' noise
BLOCKS = 20  # of a run, by whose scatter the mean of products is doubted
DOUBT = 4.0  # standard errors
FEWEST = 10  # samples of a block
NEARLY_ALL = 0.8  # of the longer of two runs, that both must have


def shared_n2(errors: Sequence[Array], velocities: Sequence[Array]) -> float:
    """The mean square in N², of all samples, of what is certainly left alike in runs of one motion.

    errors, velocities: (n each), N and m/s, of runs that end together; some begin a little later than others.
    What is as much alike in runs of different motions has not come from the motion: noise that was made once
    for all runs, say. 0 where no motion was run twice.
    """
    same: list[Pair] = []
    other: list[Pair] = []
    for a, b in combinations(range(len(errors)), 2):
        least, most = sorted((errors[a].size, errors[b].size))
        if least >= max(BLOCKS * FEWEST, NEARLY_ALL * most):
            (same if _is_one(velocities[a][-least:], velocities[b][-least:]) else other).append((a, b))
    alike = _products(errors, same)
    if not alike.size:
        return 0.0
    beside = _products(errors, other)
    certain = _mean_and_error(alike) @ [1.0, -DOUBT]
    if beside.size:
        certain -= _mean_and_error(beside) @ [1.0, DOUBT]
    spoken = sum(errors[k].size for k in {k for pair in same for k in pair})
    return max(float(certain), 0.0) * spoken / sum(e.size for e in errors)


def _is_one(a: Array, b: Array) -> bool:
    return float(np.sum((a - b) ** 2)) <= ONE_MOTION**2 * float(np.sum(a * a))


def _products(errors: Sequence[Array], pairs: Iterable[Pair]) -> Array:
    """The mean products in N² of the errors of each pair, block by block: (pairs, BLOCKS)."""
    found = []
    for a, b in pairs:
        least = min(errors[a].size, errors[b].size)
        product = errors[a][-least:] * errors[b][-least:]
        found.append([float(np.mean(part)) for part in np.array_split(product, BLOCKS)])
    return np.array(found)


def _mean_and_error(products: Array) -> Array:
    """The mean of products and its standard error, pairs that share a run being one witness."""
    by_block = products.mean(axis=0)
    return np.array([by_block.mean(), by_block.std(ddof=1) / np.sqrt(BLOCKS)])
