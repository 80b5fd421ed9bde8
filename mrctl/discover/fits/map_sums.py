"""Regression on piecewise linear maps of signals, fold by fold: what folds left out are predicted to be.

A sample lies in one cell of each map, so it has a few features of many; only those are kept and multiplied.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrctl.identify.knots import locate
from mrctl.identify.parallel import in_parallel

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

RIDGES = (1e-3, 1e-2, 1e-1, 1.0)  # of the mean information of a feature


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Of n samples, the few features that are not 0: which of `count`, and their values (n, few each)."""

    which: Ints
    values: Array
    count: int

    @classmethod
    def constant(cls, samples: int) -> Features:
        """One feature, 1 everywhere."""
        return cls(np.zeros((samples, 1), dtype=np.intp), np.ones((samples, 1)), 1)

    @classmethod
    def of(cls, signals: Sequence[Array], count: int) -> Features | None:
        """The map of one or two signals (n) on about `count` knots each; None where one hardly moves."""
        parts = []
        for x in signals:
            knots = _knots(x, count)
            if knots is None:
                return None
            parts.append(_hats(x, knots))
        if len(parts) == 1:
            return parts[0]
        first, second = parts
        which = first.which[:, :, None] * second.count + second.which[:, None, :]
        values = first.values[:, :, None] * second.values[:, None, :]
        samples = which.shape[0]
        return cls(which.reshape(samples, -1), values.reshape(samples, -1), first.count * second.count)

    @classmethod
    def beside(cls, blocks: Sequence[Features]) -> Features:
        """The features of all blocks, one block's after the other's."""
        before = np.cumsum([0] + [block.count for block in blocks])
        which = [block.which + first for block, first in zip(blocks, before[:-1], strict=True)]
        return cls(
            np.concatenate(which, axis=1),
            np.concatenate([block.values for block in blocks], axis=1),
            int(before[-1]),
        )


def _knots(x: Array, count: int) -> Array | None:
    low, high = np.quantile(x, [0.002, 0.998])
    if high - low < 0.02 * max(float(np.abs(x).max()), 1e-12):
        return None
    even = np.linspace(low, high, count // 2 + 1)
    dense = np.quantile(x, np.linspace(0.002, 0.998, count - count // 2 + 1))
    knots = np.unique(np.concatenate([even, dense]))
    kept = [knots[0]]
    for k in knots[1:]:
        if k - kept[-1] > (high - low) / (3 * count):
            kept.append(k)
    return np.array(kept) if len(kept) > 1 else None


def _hats(x: Array, knots: Array) -> Features:
    at = locate(x, knots)
    which = np.stack([at.below, at.below + 1], axis=1)
    return Features(which, np.stack([1.0 - at.share, at.share], axis=1), at.count)


@dataclass(frozen=True, slots=True, eq=False)
class MapSums:
    """What a regression needs of each fold: features times features, times the residual, and the samples."""

    grams: Array  # (folds, features, features)
    rights: Array  # (folds, features)
    counts: Ints

    @classmethod
    def of(cls, features: Features, rest: Array, fold: Ints) -> MapSums:
        """Of features and a residual (n), whose samples are in these folds (n)."""
        order = np.argsort(fold, kind="stable")
        which, values, rest = features.which[order], features.values[order], rest[order]
        ends = np.flatnonzero(np.diff(fold[order])) + 1
        spans = list(zip([0, *ends], [*ends, rest.size], strict=True))
        grams = np.zeros((len(spans), features.count, features.count))
        rights = np.zeros((len(spans), features.count))

        def add(k: int) -> None:
            own = slice(*spans[k])
            _add(which[own], values[own], rest[own], grams[k], rights[k])

        in_parallel(add, range(len(spans)))
        return cls(grams, rights, np.array([b - a for a, b in spans]))

    def of_features(self, which: Sequence[int]) -> MapSums:
        """Those of some features alone."""
        return MapSums(self.grams[:, which][:, :, which], self.rights[:, which], self.counts)

    def predicted(self) -> tuple[float, float]:
        """What prediction of folds left out takes off the mean square (best ridge), its standard error."""
        gram, right = self.grams.sum(axis=0), self.rights.sum(axis=0)
        own = np.eye(right.size) * float(np.trace(gram)) / right.size
        share = self.counts / self.counts.sum()
        best: tuple[float, float] = (0.0, 0.0)
        for ridge in RIDGES:
            w = np.linalg.solve(gram - self.grams + ridge * own, (right - self.rights)[:, :, None])[:, :, 0]
            # rest² - (rest - Xw)², summed over each fold
            gains = 2.0 * np.sum(w * self.rights, axis=1) - np.einsum("ki,kij,kj->k", w, self.grams, w)
            gains = gains / self.counts
            mean = float(np.sum(share * gains))
            error = float(np.sqrt(np.sum(share**2 * (gains - mean) ** 2)))
            if mean > best[0]:
                best = mean, error
        return best


@njit(cache=True, nogil=True)
def _add(which, values, rest, gram, right):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """The upper half, sample by sample, then the other one."""
    few = which.shape[1]
    for k in range(rest.size):
        own, by = which[k], values[k]
        for i in range(few):
            row, value = gram[own[i]], by[i]
            right[own[i]] += value * rest[k]
            for j in range(i, few):  # a later block's features come later
                row[own[j]] += value * by[j]
    for i in range(gram.shape[0]):
        for j in range(i):
            gram[i, j] = gram[j, i]
