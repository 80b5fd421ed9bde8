"""What a joint model keeps of its last normal equations: the slopes behind them, and what was asked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.solver import Normal

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class WeighedSlopes:
    """A batch's slopes (m, blocks) by parameters `index`, its residual, the weights' roots (blocks each)."""

    index: NDArray[np.intp]
    values: Array
    rest: Array
    roots: Array


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """Normal equations, and what they were asked for."""

    theta: Array
    free: NDArray[np.bool_]
    weights: Array
    skips: tuple[int, ...]  # averages of each record that are left out
    normal: Normal

    def is_of(self, theta: Array, free: NDArray[np.bool_], weights: Array, skips: tuple[int, ...]) -> bool:
        """Whether these are the ones."""
        if skips != self.skips:
            return False
        asked = (theta, free, weights)
        known = (self.theta, self.free, self.weights)
        return all(np.array_equal(one, other) for one, other in zip(asked, known, strict=True))
