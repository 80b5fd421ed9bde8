"""What a field remembers from before a run began: a larger current, which no file tells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.joint import JointModel
from mrctl.identify.records import Record

Array = NDArray[np.float64]
Past = Callable[[Sequence[Record]], list[Record]]

SAME = 1e-3  # of a run's mean square: pasts beyond a loop's reach hardly differ
CLEARER = 0.1  # of a run's mean square, that another past must take off
# From a run's first current up to the campaign's largest, where one may have been before. The largest first:
# all that are beyond a loop's reach, which may be a small part of it, are alike.
WAYS = np.geomspace(1.0, 1.0 / 32.0, 6)
NEARER = (2.0**0.5, 2.0**0.25)  # by which factor less and more is tried then


def fields_past(model: JointModel, theta: Array) -> Past | None:
    """Versions of records, in the model's order, with the pasts that suit it better; None where none does.

    A run's first current was reached from 0 A, or from a larger one up to the campaign's largest.
    """
    first_a = np.array([float(r.current_a[0]) for r in model.records])
    up_a = max(float(r.current_a.max()) for r in model.records) - first_a
    before_a = np.array([r.before_a for r in model.records])
    here = least = _errors(model, theta, before_a)

    def tried(other_a: Array) -> None:
        nonlocal before_a, least
        there = _errors(model, theta, other_a)
        better = there < (1.0 - SAME) * least
        before_a, least = np.where(better, other_a, before_a), np.where(better, there, least)

    tried(np.zeros(first_a.size))
    for way in WAYS:
        tried(first_a + way * up_a)
    for factor in NEARER:
        middle_a = before_a
        for by in (1.0 / factor, factor):
            tried(
                np.where(middle_a > first_a, first_a + np.minimum(by * (middle_a - first_a), up_a), middle_a)
            )
    better = least < (1.0 - CLEARER) * here
    if not better.any():
        return None
    found_a = [
        float(b) if use else r.before_a for b, use, r in zip(before_a, better, model.records, strict=True)
    ]

    def past(records: Sequence[Record]) -> list[Record]:
        return [replace(r, before_a=before) for r, before in zip(records, found_a, strict=True)]

    return past


def farther(records: Sequence[Record], by: float) -> list[Record]:
    """The records whose first currents came down, from as many times as far above."""
    return [
        replace(r, before_a=first + by * (r.before_a - first)) if r.before_a > first else r
        for r in records
        for first in [float(r.current_a[0])]
    ]


def came_down(records: Sequence[Record]) -> bool:
    """Whether any record's first current did."""
    return any(r.before_a > float(r.current_a[0]) for r in records)


def _errors(model: JointModel, theta: Array, before_a: Array) -> Array:
    """Each record's mean square error, its first current reached from these (records)."""
    records = [replace(r, before_a=b) for r, b in zip(model.records, before_a.tolist(), strict=True)]
    return np.array([float(np.mean(e * e)) for e in model.on(records).errors(theta)])
