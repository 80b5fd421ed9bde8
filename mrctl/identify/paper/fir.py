"""Sec. 6.2: for each run the FIR filter that takes its backbone force to its measured force.

By LMS as in the paper, and by least squares, the solution that LMS goes to. Both see the same samples.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.paper.backbone import Backbones
from mrctl.identify.paper.lms import form, lms, many_passes, pass_map, solve
from mrctl.identify.paper.options import PaperOptions
from mrctl.identify.paper.prepare import Preparation, Record

Array = NDArray[np.float64]

RECORD_SAMPLES = 5027  # six cycles of 2.387 Hz at 2 kHz: what the paper's passes went over
STABLE = 2.0  # mu |x|^2 must be below this, or an update overshoots by more than it corrects
SAFE = 1.0  # what it is brought to where it is not: the update that corrects exactly
RIDGE = 1e-10  # of the mean power: far below all that LMS can resolve, far above rounding


@dataclass(frozen=True, slots=True, eq=False)
class AdaptiveFilter:
    """One run's FIR filter (taps, newest first), by LMS and by least squares.

    passes, mse_n2: the curve of Fig. 6.2, the mean squared error after so many passes. step_per_n2: mu.
    """

    lms: Array
    least_squares: Array
    passes: NDArray[np.int64]
    mse_n2: Array
    mse_least_squares_n2: float
    step_per_n2: float


@dataclass(frozen=True, slots=True, eq=False)
class AdaptiveFilters:
    """All runs' FIR filters; `notes` says where the step had to be made smaller."""

    taps: int
    runs: tuple[AdaptiveFilter, ...]
    notes: tuple[str, ...]


def adaptive_filters(
    preparation: Preparation,
    curves: Backbones,
    options: PaperOptions,
    done: Callable[[int], None] = lambda _: None,
) -> AdaptiveFilters:
    """Identify every run's filter, some runs at a time; `done` is called with the number of runs behind."""

    def one(row: int) -> AdaptiveFilter:
        record = preparation.records[row]
        signals = training(record, curves.over_time(row, record.velocity_m_s), options.taps)
        return adaptive_filter(*signals, options)

    runs = []
    with ThreadPoolExecutor(max(1, options.workers)) as pool:
        for run in pool.map(one, range(len(preparation.records))):
            runs.append(run)
            done(len(runs))
    smaller = [r.step_per_n2 for r in runs if r.step_per_n2 < options.step_per_n2]
    notes = []
    if smaller:
        notes.append(
            f"the LMS step of {options.step_per_n2:g} /N^2 would not be stable in {len(smaller)} runs: "
            f"down to {min(smaller):.2g} there"
        )
    return AdaptiveFilters(options.taps, tuple(runs), tuple(notes))


def training(record: Record, backbone_n: Array, taps: int) -> tuple[Array, Array]:
    """(inputs (n + taps - 1), wanted (n)): the kept samples, each with its real past.

    Where the record begins too late for that, the backbone force before it is taken as the first one.
    """
    start, stop = record.kept.start, record.kept.stop
    past = start - (taps - 1)
    inputs = backbone_n[max(past, 0) : stop]
    if past < 0:
        inputs = np.concatenate([np.full(-past, backbone_n[0]), inputs])
    return np.ascontiguousarray(inputs), np.ascontiguousarray(record.force_n[start:stop])


def adaptive_filter(inputs: Array, wanted: Array, options: PaperOptions) -> AdaptiveFilter:
    """The filter of one run: LMS from zero weights, how it got there, and least squares beside it."""
    step = stable_step(inputs, options.taps, options.step_per_n2)
    history = _passes(inputs, wanted, step, options)
    gram, cross, power = normal_equations(inputs, wanted, options.taps)
    least = least_squares(gram, cross)

    def mse(weights: Array) -> float:
        return power - 2.0 * float(weights @ cross) + form(gram, weights)

    return AdaptiveFilter(
        lms=history[-1][1],
        least_squares=least,
        passes=np.array([done for done, _ in history]),
        mse_n2=np.array([mse(weights) for _, weights in history]),
        mse_least_squares_n2=mse(least),
        step_per_n2=step,
    )


def _passes(inputs: Array, wanted: Array, step: float, options: PaperOptions) -> list[tuple[int, Array]]:
    """The weights after so many passes."""
    passes = int(np.ceil(options.passes * min(1.0, RECORD_SAMPLES / wanted.size)))
    if passes > options.taps:  # the map of a pass costs about as much as `taps` passes
        return many_passes(pass_map(inputs, wanted, step, options.taps), passes)
    weights = np.zeros(options.taps)
    history = []
    for done in range(1, passes + 1):
        lms(inputs, wanted, step, weights)
        history.append((done, weights.copy()))
    return history


def stable_step(inputs: Array, taps: int, step_per_n2: float) -> float:
    """The step, or a smaller one where some window's mu |x_k|^2 is not stable."""
    square = np.concatenate([[0.0], np.cumsum(inputs**2)])
    largest = float(np.max(square[taps:] - square[:-taps]))
    return step_per_n2 if step_per_n2 * largest < STABLE else SAFE / largest


def normal_equations(inputs: Array, wanted: Array, taps: int) -> tuple[Array, Array, float]:
    """Means of x x' (taps × taps), x d (taps) and d^2 over the samples.

    Over whole cycles x x' is Toeplitz but for what differs between the cycles; here it is exact: along each
    diagonal one step adds the sample that comes in and takes the one that goes.
    """
    count = wanted.size
    newest = inputs[taps - 1 :]
    first = np.array([inputs[taps - 1 - j : taps - 1 - j + count] @ newest for j in range(taps)])
    cross = np.array([inputs[taps - 1 - j : taps - 1 - j + count] @ wanted for j in range(taps)])
    # x_k[j] = inputs[taps - 1 - j + k]; from (i, j) to (i + 1, j + 1) the sum's range moves one sample back.
    comes = inputs[: taps - 1][::-1]  # inputs[taps - 2 - j], j = 0 ...
    goes = inputs[count : count + taps - 1][::-1]
    change = np.outer(comes, comes) - np.outer(goes, goes)
    gram = np.empty((taps, taps))
    gram[0, :] = gram[:, 0] = first
    for i in range(1, taps):
        gram[i, 1:] = gram[i - 1, :-1] + change[i - 1, :]
    gram = 0.5 * (gram + gram.T)
    return gram / count, cross / count, float(wanted @ wanted) / count


def least_squares(gram: Array, cross: Array) -> Array:
    """The weights of the smallest mean squared error; a touch of ridge settles what the data leaves open."""
    ridge = RIDGE * float(np.trace(gram)) * np.eye(gram.shape[0])
    return solve(gram + ridge, cross)
