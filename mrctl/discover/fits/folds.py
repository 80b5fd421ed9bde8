"""Which parts of a campaign are held out together: whole runs where others cover their conditions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.records import Record

Ints = NDArray[np.intp]

FOLDS = 8
PIECES = 4  # a run that holds the only data at its conditions is held out in so many pieces
FEWEST_RUNS = 4
AS_MUCH = 0.3  # of a record's largest current, that another one must reach to tell what warmth does to it
SAME_A, SAME_C, SAME_SPEED = 0.06, 4.0, 0.9


def folds_of(records: Sequence[Record]) -> list[tuple[int, ...]]:
    """For each record the folds of its equal pieces: one fold, or PIECES of them in turn.

    A record whose current, temperature or speed no other reaches would be extrapolated, not predicted, if it
    were held out whole.
    """
    if len(records) < FEWEST_RUNS:
        pieces = max(PIECES, FOLDS // max(len(records), 1))
        return [tuple((n * pieces + k) % FOLDS for k in range(pieces)) for n in range(len(records))]
    count = min(FOLDS, len(records))
    result: list[tuple[int, ...]] = []
    turn = 0
    for n, record in enumerate(records):
        if covered(record, [r for m, r in enumerate(records) if m != n]):
            result.append((turn % count,))
            turn += 1
        else:
            result.append(tuple((n + k) % count for k in range(PIECES)))
    return result


def labels(folds: tuple[int, ...], size: int) -> Ints:
    """The fold of each of a record's `size` samples."""
    return np.array(folds, dtype=np.intp)[np.arange(size) * len(folds) // max(size, 1)]


def covered(record: Record, others: Sequence[Record]) -> bool:
    """Whether other records reach this one's current, temperature and speed."""
    middle = _steady_a(record)
    if middle is not None:
        current = any(float(np.mean(np.abs(r.current_a - middle) < SAME_A)) > 0.1 for r in others)
    else:
        low, high = float(record.current_a.min()), float(record.current_a.max())
        current = any(
            float(r.current_a.min()) < low + SAME_A and float(r.current_a.max()) > high - SAME_A
            for r in others
        )
    warm = float(record.temperature_c.mean())
    temperature = any(abs(float(r.temperature_c.mean()) - warm) < SAME_C for r in others)
    speed = SAME_SPEED * float(np.abs(record.velocity_m_s).max())
    fast = any(float(np.abs(r.velocity_m_s).max()) >= speed for r in others)
    return current and temperature and fast


def held_as_long(record: Record, others: Sequence[Record]) -> bool:
    """Whether another record holds the current that this one holds; true where it holds none."""
    current = _steady_a(record)
    if current is None:
        return True
    held = (_steady_a(other) for other in others)
    return any(other is not None and abs(other - current) < SAME_A for other in held)


def as_warm(record: Record, others: Sequence[Record]) -> bool:
    """Whether another record is as warm with about as much current, or without any as this one is.

    What warmth does to a field's force no run without a field tells.
    """
    warm, most = float(record.temperature_c.mean()), float(record.current_a.max())
    alike = [r for r in others if abs(float(r.temperature_c.mean()) - warm) < SAME_C]
    if most < SAME_A:
        return any(float(r.current_a.min()) < SAME_A for r in alike)
    return any(float(r.current_a.max()) > AS_MUCH * most for r in alike)


def _steady_a(record: Record) -> float | None:
    """The current in A where it is one throughout."""
    low, high = float(record.current_a.min()), float(record.current_a.max())
    return 0.5 * (low + high) if high - low < SAME_A else None
