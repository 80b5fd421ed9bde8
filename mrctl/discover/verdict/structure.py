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

from mrctl.discover.fits.folds import labels
from mrctl.discover.fits.map_sums import Features, MapSums
from mrctl.discover.fits.signals import UNITS, signals_of
from mrctl.identify.joint_fit import JointFit

Array = NDArray[np.float64]

KNOTS, PAIR_KNOTS = 12, 6
MOST_SAMPLES = 30000
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
        block = Features.of([pooled[n] for n in names], KNOTS if len(names) == 1 else PAIR_KNOTS)
        if block is not None:
            blocks[names] = block
    if not blocks:
        return Structure(float(np.mean(rest**2)), 0.0, 0.0, ())
    features = Features.beside([*blocks.values(), Features.constant(rest.size)])
    sums = MapSums.of(features, rest, fold)
    explained, spread = sums.predicted()
    ends = np.cumsum([block.count for block in blocks.values()])
    columns = np.split(np.arange(ends[-1]), ends[:-1])
    maps = []
    for names, block_columns in zip(blocks, columns, strict=True):
        alone, _ = sums.of_features([*block_columns, -1]).predicted()
        maps.append(Map(names, alone, *_mean_map([pooled[n] for n in names], rest)))
    maps.sort(key=lambda m: -m.explained_n2)
    return Structure(float(np.mean(rest**2)), explained, spread, tuple(maps))


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
