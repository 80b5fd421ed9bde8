"""Whether what a model leaves knows of the motion or the current: a load cell's noise does not.

Nor does the noise of a measured motion, but for where the damper is steep.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PARTS, FEWEST = 5, 50  # of a signal's samples, as many in each; and how many at least
LOUDER, LOUDER_RUN = 2.5, 4.0  # in mean square, the loudest part over the quietest, and the loudest run
# Over which noise changes as much in any run; what goes with the motion does not.
APART_S = (0.005, 0.02, 0.08)
APART_TWO_S = (0.02, 0.08)  # the same, of two noises: that of the steep is slower than that of the flat
LITTLE, MUCH = 0.1, 0.8  # quantiles of the force's size: up to which it is little, and from which much
SWELLING = 5.0  # in mean square, what comes with the force, where that is much over where it is little
SLOW = 0.25  # of a white error's change from sample to sample, that a slow one may have


def is_indifferent(
    errors: Sequence[Array],
    signals: Sequence[Sequence[Array]],
    rates_hz: Sequence[float],
    apart_s: Sequence[float] = APART_S,
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
        for s in (0.0, *apart_s)
    ):
        return False
    return all(
        _spread(every, np.concatenate([x[h] for x, h in zip(signal, heard, strict=True)])) <= LOUDER
        for signal in signals
    )


def by_steepness(errors: Sequence[Array], steepness: Sequence[Array]) -> list[Array]:
    """Errors (n each run) in units of how loud they are where the damper is as steep.

    steepness (n each): by how much the model's force changes with the velocity. What noise of a measured
    motion makes of a force is in proportion to it, and the load cell's own comes on top. How loud the first
    is the steepest and the flattest parts tell.
    """
    squares = np.concatenate(errors) ** 2
    steep = np.concatenate(steepness) ** 2
    heard = squares > 0.0
    if np.count_nonzero(heard) < PARTS * FEWEST:
        return list(errors)
    low, high = np.quantile(steep[heard], (1.0 / PARTS, 1.0 - 1.0 / PARTS))
    flat, steepest = heard & (steep <= low), heard & (steep >= high)
    over = float(steep[steepest].mean() - steep[flat].mean())
    louder = float(squares[steepest].mean() - squares[flat].mean())
    share = max(louder, 0.0) / over if over > 0.0 else 0.0
    own = max(float(squares[flat].mean()) - share * float(steep[flat].mean()), 1e-3 * float(squares.mean()))
    return [e / np.sqrt(own + share * s * s) for e, s in zip(errors, steepness, strict=True)]


def swells(errors: Sequence[Array], forces: Sequence[Array]) -> float:
    """The mean square in N² of errors that come with the force's size within the runs; 0 where they do not.

    errors, forces: (n) each run, N. What does not repeat from cycle to cycle is no load cell's noise if it
    dies down whenever the force does, and is too slow for a converter's: a supply or a valve hunts, say.
    """
    slow = [(e, np.abs(f) / np.max(np.abs(f))) for e, f in zip(errors, forces, strict=True) if _is_slow(e)]
    heard = [(e[e != 0.0], f[e != 0.0]) for e, f in slow]
    if sum(e.size for e, _ in heard) < PARTS * FEWEST:
        return 0.0
    squares = np.concatenate([e * e / np.mean(e * e) for e, _ in heard])
    sizes = np.concatenate([f for _, f in heard])
    least, most = np.quantile(sizes, (LITTLE, MUCH))
    if np.mean(squares[sizes >= most]) < SWELLING * np.mean(squares[sizes <= least]):
        return 0.0
    return float(sum(e @ e for e, _ in heard)) / sum(np.count_nonzero(e) for e in errors)


def _is_slow(error: Array) -> bool:
    """Whether little of an error changes from sample to sample."""
    own = _change(error, 0)
    return bool(np.isfinite(own)) and _change(error, 1) < SLOW * 2.0 * own


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
