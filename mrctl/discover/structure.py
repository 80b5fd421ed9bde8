"""What is left in a residual that the signals predict, whatever the physics: held-out regression on maps.

The residual is regressed on maps of one and of two signals (piecewise linear), with ridge; every fold is
predicted from the others. Noise, of any colour, is not predicted. So the share of the square sum that is
predicted is a lower bound on what a better model would remove, and the best map shows where it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.folds import labels
from mrctl.discover.signals import UNITS, signals_of
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.parallel import in_parallel

Array = NDArray[np.float64]

KNOTS, PAIR_KNOTS = 12, 6
MOST_SAMPLES = 30000
RIDGES = (1e-3, 1e-2, 1e-1, 1.0)  # of the mean information of a feature
PAIRS = (
    ("velocity", "stroke"),
    ("velocity", "acceleration"),
    ("velocity", "current"),
    ("velocity", "temperature"),
    ("stroke", "acceleration"),
    ("stroke", "current"),
    ("current", "current rate"),
    ("force", "force rate"),
    ("force", "energy"),
    ("velocity", "turned"),
)
SINGLES = ("velocity", "stroke", "acceleration", "current", "current rate", "temperature", "time", "energy")


@dataclass(frozen=True, slots=True, eq=False)
class Map:
    """The residual over one or two signals: what the map alone predicts, held out, of the mean square."""

    signals: tuple[str, ...]
    explained_n2: float
    edges: tuple[Array, ...]
    mean_n: Array  # (bins of the last signal, ..., bins of the first); NaN where there is no data


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """What all maps together predict of the residual's mean square, with its standard error over folds."""

    mean_square_n2: float
    explained_n2: float
    error_n2: float
    maps: tuple[Map, ...]  # best first

    @property
    def share(self) -> float:
        """Of the mean square."""
        return self.explained_n2 / self.mean_square_n2 if self.mean_square_n2 > 0.0 else 0.0

    @property
    def significant(self) -> bool:
        """Whether the folds agree that something is left."""
        return self.explained_n2 > 3.0 * self.error_n2 and self.explained_n2 > 0.0


def structure_of(fit: JointFit, folds: Sequence[tuple[int, ...]]) -> Structure:
    """What the signals predict of a fit's residual."""
    model, theta = fit.model, fit.theta
    residuals, signals, where = [], [], []
    total = sum(r.force_n.size // model.factor(r) for r in model.records)
    stride = max(1, total // MOST_SAMPLES)
    for record, force, error, own in zip(
        model.records, model.predict(theta), model.errors(theta), folds, strict=True
    ):
        factor, skip = model.factor(record), model.settle_blocks(theta, record)
        raw = signals_of(record, force)
        chosen = slice(skip, None, stride)
        residuals.append(model.weighed(record, error)[chosen])
        signals.append({name: model.weighed(record, x)[chosen] for name, x in raw.items()})
        where.append(labels(own, record.force_n.size // factor)[chosen])
    rest, fold = np.concatenate(residuals), np.concatenate(where)
    pooled = {name: np.concatenate([s[name] for s in signals]) for name in UNITS}
    blocks = {}
    for names in [(n,) for n in SINGLES] + list(PAIRS):
        block = _features([pooled[n] for n in names], KNOTS if len(names) == 1 else PAIR_KNOTS)
        if block is not None:
            blocks[names] = block
    if not blocks:
        return Structure(float(np.mean(rest**2)), 0.0, 0.0, ())
    sums = _Sums.of([*blocks.values(), np.ones((rest.size, 1))], rest, fold)
    explained, spread = sums.predicted()
    ends = np.cumsum([block.shape[1] for block in blocks.values()])
    columns = np.split(np.arange(ends[-1]), ends[:-1])
    maps = []
    for names, features in zip(blocks, columns, strict=True):
        alone, _ = sums.of_features([*features, -1]).predicted()
        maps.append(Map(names, alone, *_mean_map([pooled[n] for n in names], rest)))
    maps.sort(key=lambda m: -m.explained_n2)
    return Structure(float(np.mean(rest**2)), explained, spread, tuple(maps))


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


def _hats(x: Array, knots: Array) -> Array:
    at = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, knots.size - 2)
    share = np.clip((x - knots[at]) / np.diff(knots)[at], 0.0, 1.0)
    out = np.zeros((x.size, knots.size))
    rows = np.arange(x.size)
    out[rows, at] = 1.0 - share
    out[rows, at + 1] = share
    return out


def _features(signals: list[Array], count: int) -> Array | None:
    parts = []
    for x in signals:
        knots = _knots(x, count)
        if knots is None:
            return None
        parts.append(_hats(x, knots))
    if len(parts) == 1:
        return parts[0]
    return np.asarray((parts[0][:, :, None] * parts[1][:, None, :]).reshape(signals[0].size, -1))


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """What a regression needs of each fold: features times features, times the residual, and the samples."""

    grams: Array  # (folds, features, features)
    rights: Array  # (folds, features)
    counts: NDArray[np.intp]

    @classmethod
    def of(cls, blocks: Sequence[Array], rest: Array, fold: NDArray[np.intp]) -> _Sums:
        """Of the columns of blocks (n, ...) and a residual (n), whose samples are in these folds (n)."""
        order = np.argsort(fold, kind="stable")
        features, rest = np.concatenate(blocks, axis=1)[order], rest[order]
        ends = np.flatnonzero(np.diff(fold[order])) + 1
        spans = list(zip([0, *ends], [*ends, rest.size], strict=True))
        grams = in_parallel(lambda span: features[slice(*span)].T @ features[slice(*span)], spans)
        rights = [features[a:b].T @ rest[a:b] for a, b in spans]
        return cls(np.array(grams), np.array(rights), np.array([b - a for a, b in spans]))

    def of_features(self, which: Sequence[int]) -> _Sums:
        """Those of some features alone."""
        return _Sums(self.grams[:, which][:, :, which], self.rights[:, which], self.counts)

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


def _mean_map(signals: list[Array], rest: Array, bins: int = 10) -> tuple[tuple[Array, ...], Array]:
    edges = tuple(
        np.linspace(float(np.quantile(x, 0.005)), float(np.quantile(x, 0.995)), bins + 1) for x in signals
    )
    at = [
        np.clip(np.searchsorted(e, x, side="right") - 1, 0, bins - 1)
        for e, x in zip(edges, signals, strict=True)
    ]
    cell = at[0] if len(at) == 1 else at[1] * bins + at[0]
    size = bins ** len(at)
    count = np.bincount(cell, minlength=size)
    total = np.bincount(cell, rest, minlength=size)
    mean = np.where(count >= 20, total / np.maximum(count, 1), np.nan)
    return edges, mean.reshape((bins,) * len(at))
