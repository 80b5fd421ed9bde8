"""When the steps of a current that a controller sets all the time were: all of a run's at once.

A semi-active law switches whenever a velocity changes sign, and its current stands still between two of the
controller's cycles: the force still answers to one step as the next one comes. So the answers to all of them
are told apart together, by least squares, each time held to what a uniform spread expects.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from mrctl.identify.noise import usual_n2

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Errors = Callable[[Sequence[Array]], list[Array]]  # of shares (steps) of each run: a model's errors (n each)

STANDS_OUT = 3.0  # times the changes right beside it, for a change to be a step and not a slope
MOST_AT_ONCE = 32  # steps within one answer: with more, their answers cannot be told apart
TRIED = 0.25  # of an interval, to either side
ROUNDS = 3
UNIFORM = 12.0  # one over the variance of a time that is uniform over one interval
HALF = 0.5
FEWEST_SHARED = 30  # steps of a run, to say what they have in common
SHARED_ROUNDS = 20
LEAST_APART = 0.02  # of an interval, that no clock does better than
BLOCK = 64  # steps


def dense_steps(jumps: Array, least_a: float) -> Ints:
    """Which changes (n) of a current in A from sample to sample are steps, however near to each other."""
    beside = np.maximum(np.append(jumps[1:], 0.0), np.insert(jumps[:-1], 0, 0.0))
    at = np.flatnonzero((jumps >= least_a) & (jumps >= STANDS_OUT * beside))
    return np.asarray(at[at > 0], dtype=np.intp)


def at_once(at: Ints, span: int) -> int:
    """The most of the steps (samples, rising) within one answer, which lasts `span` samples."""
    return int(np.max(np.searchsorted(at, at + span) - np.arange(at.size))) if at.size else 0


def shares_of(places: Sequence[Ints], spans: Sequence[int], errors: Errors) -> list[Array]:
    """How much earlier than the middle of its interval each of the steps was, in intervals, within a half.

    places: of each run's steps, the last measured samples before; spans: for how many the force answers to
    one; errors: of a model, at the measured samples, with each run's steps at such shares.
    """
    shares = [np.zeros(at.size) for at in places]
    apart = max(at_once(at, span) for at, span in zip(places, spans, strict=True))
    for number in range(ROUNDS):
        here = errors(shares)
        answers = _answers(shares, places, spans, apart, errors)
        for k, (at, error) in enumerate(zip(places, here, strict=True)):
            if at.size:
                noise = max(usual_n2(error), 1e-300)
                # What they have in common is asked when their times are no longer what is left.
                shared = number == ROUNDS - 1 and at.size >= FEWEST_SHARED
                shares[k] = _solved(at, error, answers[k], shares[k], noise, SHARED_ROUNDS if shared else 1)
    return shares


def _answers(
    shares: Sequence[Array], places: Sequence[Ints], spans: Sequence[int], apart: int, errors: Errors
) -> list[Array]:
    """How a model's error moves with each step's share, from the sample before it on: (steps, span) each.

    Steps whose answers do not meet are moved together.
    """
    found = [np.zeros((at.size, span)) for at, span in zip(places, spans, strict=True)]
    for turn in range(apart):
        chosen = [np.arange(at.size) % apart == turn for at in places]
        early, late = (
            errors([np.clip(s + side * TRIED * c, -HALF, HALF) for s, c in zip(shares, chosen, strict=True)])
            for side in (1.0, -1.0)
        )
        for k, at in enumerate(places):
            slope = early[k] - late[k]
            for n in np.flatnonzero(chosen[k]):
                moved = min(shares[k][n] + TRIED, HALF) - max(shares[k][n] - TRIED, -HALF)
                own = slope[at[n] : at[n] + spans[k]]
                found[k][n, : own.size] = own / moved
    return found


def _solved(at: Ints, error: Array, answers: Array, shares: Array, noise: float, rounds: int) -> Array:
    """The shares (steps) at which the error (n) is least for what it costs them to be unlike the others.

    A controller whose clock goes with the logger's steps at the same share each time, another's anywhere:
    how far apart they are, and about which, is told by all of them (empirical Bayes; MacKay, Neural Comput. 4
    (1992)), and no further than evenly over the interval.
    """
    span = answers.shape[1]
    width = at_once(at, span)
    bands, right = np.zeros((width, at.size)), np.zeros(at.size)
    for n in range(at.size):
        left = error[at[n] : at[n] + span]
        right[n] = -float(answers[n, : left.size] @ left)
        for lower in range(width):
            other = n + lower
            if other < at.size and at[other] - at[n] < span:
                later = at[other] - at[n]
                bands[lower, n] = float(answers[n, later:] @ answers[other, : span - later])
    middle, apart = 0.0, UNIFORM**-0.5
    found, held, whole = shares, 0.0, bands
    for number in range(rounds):
        if number:
            middle = float(np.clip(found.mean(), -HALF, HALF))
            known = at.size - held * float(_inverse_diagonal(whole).sum())  # how many of them the data tell
            spread = float(np.sum((found - middle) ** 2)) / max(known, 1.0)
            apart = min(max(spread**0.5, LEAST_APART), UNIFORM**-0.5)
        held = noise / apart**2
        whole = bands.copy()
        whole[0] += held
        found = shares + solveh_banded(whole, right - held * (shares - middle), lower=True)
    return np.asarray(np.clip(found, -HALF, HALF))


def _inverse_diagonal(bands: Array) -> Array:
    """The diagonal (n) of a banded symmetric matrix's inverse, lower bands given, by blocks of it."""
    width, n = bands.shape
    found = np.empty(n)
    for first in range(0, n, BLOCK):
        size = min(BLOCK, n - first)
        block = np.zeros((size, size))
        for lower in range(min(width, size)):
            k = np.arange(size - lower)
            block[k + lower, k] = block[k, k + lower] = bands[lower, first : first + size - lower]
        found[first : first + size] = np.diag(np.linalg.inv(block))
    return found
