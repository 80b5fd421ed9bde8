"""Whether what a model leaves knows of the motion or the current: a load cell's noise does not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PARTS, FEWEST = 5, 50  # of a signal's samples, as many in each; and how many at least
LOUDER, LOUDER_RUN = 2.5, 4.0  # in mean square, the loudest part over the quietest, and the loudest run


def is_indifferent(errors: Sequence[Array], signals: Sequence[Sequence[Array]]) -> bool:
    """Whether errors (n each run) are about as loud in every run, and wherever each of the signals goes.

    signals: several, each of n each run. A model's error comes with the force, or at some speeds or currents:
    there it is ten times as loud. Slow noise is not so even either, by chance. Samples without an error
    (exactly 0: left out) are not asked.
    """
    heard = [e != 0.0 for e in errors]
    every = np.concatenate([e[h] for e, h in zip(errors, heard, strict=True)]) ** 2
    runs = [float(np.mean(e[h] ** 2)) for e, h in zip(errors, heard, strict=True) if h.sum() >= FEWEST]
    if every.size < PARTS * FEWEST or max(runs, default=np.inf) > LOUDER_RUN * min(runs, default=0.0):
        return False
    return all(
        _spread(every, np.concatenate([x[h] for x, h in zip(signal, heard, strict=True)])) <= LOUDER
        for signal in signals
    )


def _spread(squares: Array, signal: Array) -> float:
    """The loudest part of a signal's range over the quietest; 1 where the signal does not change."""
    part = np.searchsorted(np.quantile(signal, np.arange(1, PARTS) / PARTS), signal)
    counts = np.bincount(part, minlength=PARTS)
    asked = counts >= FEWEST
    loud = np.bincount(part, squares, PARTS)[asked] / counts[asked]
    return float(loud.max() / loud.min())
