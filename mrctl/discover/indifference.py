"""Whether what a model leaves knows of the motion or the current: a load cell's noise does not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PARTS, FEWEST = 5, 50  # of a signal's samples, as many in each; and how many at least
LOUDER, LOUDER_RUN = 2.5, 4.0  # in mean square, the loudest part over the quietest, and the loudest run
APART_S = (
    0.005,
    0.02,
    0.08,
)  # over which noise changes as much in any run; what goes with the motion does not


def is_indifferent(
    errors: Sequence[Array], signals: Sequence[Sequence[Array]], rates_hz: Sequence[float]
) -> bool:
    """Whether errors (n each run) are about as loud in every run, and wherever each of the signals goes.

    signals: several, each of n each run. A model's error comes with the force, or at some speeds or currents:
    there it is ten times as loud. Slow noise is not so even either, by chance. And an error that is as loud
    everywhere but goes with the motion is faster where that is. Samples without an error (exactly 0: left
    out) are not asked.
    """
    heard = [e != 0.0 for e in errors]
    every = np.concatenate([e[h] for e, h in zip(errors, heard, strict=True)]) ** 2
    if every.size < PARTS * FEWEST:
        return False
    if not all(
        _alike([_change(e, round(s * hz)) for e, hz in zip(errors, rates_hz, strict=True)])
        for s in (0.0, *APART_S)
    ):
        return False
    return all(
        _spread(every, np.concatenate([x[h] for x, h in zip(signal, heard, strict=True)])) <= LOUDER
        for signal in signals
    )


def _change(error: Array, apart: int) -> float:
    """The mean square of an error's change over so many samples, of itself over none; NaN where few are."""
    here, there = error[: error.size - apart], error[apart:]
    both = (here != 0.0) & (there != 0.0)
    if np.count_nonzero(both) < FEWEST:
        return float("nan")
    return float(np.mean((there - here if apart else here)[both] ** 2))


def _alike(sizes: Sequence[float]) -> bool:
    """Whether the mean squares of all runs that say something are near each other."""
    told = [x for x in sizes if np.isfinite(x)]
    return bool(told) and max(told) <= LOUDER_RUN * min(told)


def _spread(squares: Array, signal: Array) -> float:
    """The loudest part of a signal's range over the quietest; 1 where the signal does not change."""
    part = np.searchsorted(np.quantile(signal, np.arange(1, PARTS) / PARTS), signal)
    counts = np.bincount(part, minlength=PARTS)
    asked = counts >= FEWEST
    loud = np.bincount(part, squares, PARTS)[asked] / counts[asked]
    return float(loud.max() / loud.min())
