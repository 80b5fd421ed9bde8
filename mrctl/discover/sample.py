"""Some of the records, enough to choose by: between starting points, or candidates at first glance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.joint import JointModel

Array = NDArray[np.float64]

ENOUGH = 8000  # weighed samples
_SEED = 1  # of the order in which records come that nothing else speaks for: not that of the files


def sampled(model: JointModel, theta: Array) -> JointModel:
    """The model on the records that it fits worst and on others by lot, half and half; all if they are few.

    An effect that acts in few records leaves its error there. Weights stay as they are.
    """
    residuals = model.residuals(theta)
    sizes = [max(r.size, 1) for r in residuals]
    if sum(sizes) <= 1.5 * ENOUGH:
        return model
    squares = [w * float(r @ r) / max(r.size, 1) for w, r in zip(model.weights, residuals, strict=True)]
    worst = np.argsort(squares)[::-1].tolist()
    taken = _up_to(worst, sizes, ENOUGH // 2)
    lot = [k for k in np.random.default_rng(_SEED).permutation(len(sizes)).tolist() if k not in taken]
    taken = sorted([*taken, *_up_to(lot, sizes, ENOUGH - sum(sizes[k] for k in taken))])
    few = model.on([model.records[k] for k in taken])
    few.weights, few.noise_n = model.weights[taken], model.noise_n[taken]
    return few


def _up_to(order: Sequence[int], sizes: Sequence[int], most: int) -> list[int]:
    """The first of an order, one at least, until that many samples are reached."""
    reached = np.cumsum([sizes[k] for k in order])
    return list(order[: 1 + int(np.searchsorted(reached, most))])
