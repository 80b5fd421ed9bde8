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

CLEARER = 0.1  # of a run's mean square, that another past must take off


def fields_past(model: JointModel, theta: Array) -> Past | None:
    """Versions of records, in the model's order, with the pasts that suit it better; None where none does.

    A run's first current was reached from 0 A or from the campaign's largest one.
    """
    top_a = max(float(r.current_a.max()) for r in model.records)
    other = [replace(r, before_a=0.0 if r.before_a else top_a) for r in model.records]
    here, there = (
        np.array([float(np.mean(e * e)) for e in one.errors(theta)]) for one in (model, model.on(other))
    )
    better = there < (1.0 - CLEARER) * here
    if not better.any():
        return None
    before_a = [
        o.before_a if use else r.before_a for o, r, use in zip(other, model.records, better, strict=True)
    ]

    def past(records: Sequence[Record]) -> list[Record]:
        return [replace(r, before_a=before) for r, before in zip(records, before_a, strict=True)]

    return past
