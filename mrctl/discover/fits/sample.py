"""Some of the records, enough to choose by: between starting points, or candidates at first glance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import Penalty
from mrctl.identify.records import Record
from mrctl.model.effects.base import Effect, Stage

Array = NDArray[np.float64]

ENOUGH = 8000  # weighed samples
PIECE = ENOUGH // 4  # of a record that is longer than that
HELD = 0.1  # of what all records say of a parameter, that still counts where a fit is to some of them
_SEED = 1  # of the order in which records come that nothing else speaks for: not that of the files


def sampled(model: JointModel, theta: Array, *, whole: bool = False) -> JointModel:
    """The model on the records that it fits worst and on others by lot, half and half; all if they are few.

    An effect that acts in few records leaves its error there. Records that are longer than all that is wanted
    count as several; whole: not so, for what `remembers_long`. Weights stay as they are.
    """
    residuals = model.residuals(theta)
    if sum(r.size for r in residuals) <= 1.5 * ENOUGH:
        return model
    pieces: list[Record] = []
    errors: list[Array] = []
    owners: list[int] = []
    for number, (record, rest) in enumerate(zip(model.records, residuals, strict=True)):
        factor = model.factor(record)
        long = not whole and len(record) // factor > ENOUGH
        count = rest.size // PIECE if long else 1
        pieces += _cut(record, factor, count)
        errors += np.array_split(rest, count)
        owners += [number] * count
    sizes = [max(e.size, 1) for e in errors]
    squares = [
        model.weights[k] * float(e @ e) / size for k, e, size in zip(owners, errors, sizes, strict=True)
    ]
    worst = np.argsort(squares)[::-1].tolist()
    taken = _up_to(worst, sizes, ENOUGH // 2)
    lot = [k for k in np.random.default_rng(_SEED).permutation(len(sizes)).tolist() if k not in taken]
    taken = sorted([*taken, *_up_to(lot, sizes, ENOUGH - sum(sizes[k] for k in taken))])
    few = model.on([pieces[k] for k in taken])
    of = [owners[k] for k in taken]
    few.weights, few.noise_n, few.settling_s = model.weights[of], model.noise_n[of], model.settling_s
    return few


def remembers_long(effects: Iterable[Effect]) -> bool:
    """Whether a model with these effects remembers as long as long records last, which then stay whole."""
    return any(effect.stage is Stage.TEMPERATURE for effect in effects)


def as_all_say(fit: JointFit, theta: Array, *, warmth: bool = True) -> Penalty:
    """A weak hold of a fit to some of the records, at theta: as firm as all records make each parameter.

    Some records say little of some parameters, which then go anywhere for a little of the error: what such a
    fit promises all records do not keep. theta: the fit's parameters, maybe others, and more behind them that
    are not held. warmth: those of the temperature are held too; else the hold is one whatever h may be.
    """
    known, layout = fit.solution.normal.matrix, fit.model.layout
    if not warmth:
        h = np.r_[layout.parts["h_on"], layout.parts["h_off"]]
        by_h = known[:, h] @ np.linalg.pinv(known[np.ix_(h, h)], hermitian=True) @ known[h]
        known = known - by_h
    values, vectors = np.linalg.eigh(known)
    own = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    rows = np.pad(own, ((0, 0), (0, theta.size - fit.theta.size)))
    return Penalty("all records", rows, rows @ theta, HELD, adapts=False)


def has_long(model: JointModel) -> bool:
    """Whether a record is longer than all that is wanted."""
    return any(len(r) // model.factor(r) > ENOUGH for r in model.records)


def _cut(record: Record, factor: int, count: int) -> list[Record]:
    """The record in so many parts, between samples that are weighed together."""
    ends = np.linspace(0, len(record) // factor, count + 1).astype(int) * factor
    ends[-1] = len(record)
    return [record.part(a, b) for a, b in pairwise(ends.tolist())] if count > 1 else [record]


def _up_to(order: Sequence[int], sizes: Sequence[int], most: int) -> list[int]:
    """The first of an order, one at least, until that many samples are reached."""
    reached = np.cumsum([sizes[k] for k in order])
    return list(order[: 1 + int(np.searchsorted(reached, most))])
