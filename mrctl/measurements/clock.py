"""The time axis of a run: uniform as it is, uniform after a stated mending, or refused.

Stamps within a quarter of a step of their places are uniform (a data logger's jitter). Stamps that a file
rounded, so that some repeat, are put back on the even grid that they were rounded from. Missing samples are
interpolated where a straight line between the neighbours errs by no more than 1 % of the motion: for a sine
of angular frequency w and a gap of T seconds the error is (w T)^2 / 8, so w T may be 0.28. Larger gaps are
refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from mrctl.errors import Problem
from mrctl.measurements.run import FloatArray, IntArray

if TYPE_CHECKING:
    from collections.abc import Callable

JITTER = 0.25
"""Share of a step by which a stamp may miss its place and still count as uniform."""
GAP_PHASE = 0.28
GAP_SAMPLES = 20
"""However slow the motion, more missing samples than this are a gap."""


@dataclass(frozen=True, slots=True)
class Clock:
    """A uniform time axis; `resample`: channels must be interpolated onto it; `note`: what was done."""

    time_s: FloatArray
    rate_hz: float
    resample: bool = False
    note: str | None = None


def settle_clock(
    time: FloatArray, motion: FloatArray | None, file: str, row: Callable[[int], int]
) -> tuple[Clock | None, list[Problem]]:
    """The uniform clock behind the stamps `time` (n,), or the problems that forbid one.

    `motion` is a velocity or displacement on the same stamps, which says how fast things move; `row` gives a
    sample's line in the file.
    """
    steps = np.diff(time)
    even = _even(time)
    if np.any(steps <= 0):
        quantum = _resolution(time)
        if np.all(steps >= 0) and even[-1] > even[0] and np.max(np.abs(time - even)) <= 0.75 * quantum:
            rate = (len(time) - 1) / (even[-1] - even[0])
            note = f"time stamps are rounded to {quantum:g} s and repeat; read as uniform at {rate:.6g} Hz"
            return Clock(even, float(rate), note=note), []
        return None, _not_forward(time, steps, file, row)
    step = float(np.median(steps))
    uniform = np.linspace(time[0], time[-1], len(time))
    if np.max(np.abs(steps - step)) <= 2 * JITTER * step and np.max(np.abs(time - uniform)) <= JITTER * step:
        return Clock(time, (len(time) - 1) / (time[-1] - time[0])), []
    allowed = min(GAP_SAMPLES * step, GAP_PHASE / _angular_frequency(time, motion))
    allowed = max(allowed, 2.5 * step)
    wide = np.flatnonzero(steps > allowed)
    if len(wide):
        return None, [_gap(time, steps, wide, step, file, row)]
    count = round((time[-1] - time[0]) / step)
    grid = np.linspace(time[0], time[-1], count + 1)
    rate = count / (time[-1] - time[0])
    longest = float(np.max(steps)) / step
    note = f"uneven sampling (steps up to {longest:.3g} times the usual one); interpolated to {rate:.6g} Hz"
    return Clock(grid, float(rate), resample=True, note=note), []


def _even(time: FloatArray) -> FloatArray:
    """The straight line through the stamps."""
    index = np.arange(len(time), dtype=np.float64)
    line: FloatArray = np.polynomial.Polynomial.fit(index, time, 1)(index)
    return line


def _resolution(time: FloatArray) -> float:
    """The last decimal place that the stamps use, in s."""
    for digits in range(10):
        quantum = 10.0**-digits
        if np.max(np.abs(time / quantum - np.round(time / quantum))) < 1e-3:
            return quantum
    return 0.0


def _angular_frequency(time: FloatArray, motion: FloatArray | None) -> float:
    """How fast the motion turns, rad/s, by its crossings of the middle; at least one half turn a run."""
    duration = max(float(time[-1] - time[0]), np.finfo(float).tiny)
    if motion is None:
        return pi / duration
    centred = motion - np.median(motion)
    signs = np.sign(centred[np.abs(centred) > 0.1 * np.max(np.abs(centred))])
    return pi * max(1, int(np.count_nonzero(np.diff(signs)))) / duration


def _not_forward(time: FloatArray, steps: FloatArray, file: str, row: Callable[[int], int]) -> list[Problem]:
    """One problem for a clock that runs backwards, one for stamps that repeat."""
    problems = []
    back, same = np.flatnonzero(steps < 0), np.flatnonzero(steps == 0)
    if len(back):
        at = int(back[0])
        what = f"time goes backwards, from {time[at]:.9g} to {time[at + 1]:.9g} s{_times(len(back))}"
        mend = "put the rows in order; if two recordings follow one another, make two files"
        problems.append(Problem(file, row(at + 1), what, mend))
    if len(same):
        at = int(same[0])
        what = f"time stands still at {time[at]:.9g} s{_times(len(same))}"
        mend = "remove the repeated rows, or export time with more digits"
        problems.append(Problem(file, row(at + 1), what, mend))
    return problems


def _gap(
    time: FloatArray, steps: FloatArray, wide: IntArray, step: float, file: str, row: Callable[[int], int]
) -> Problem:
    """The problem of gaps that are too wide to bridge."""
    at = int(wide[0])
    width = f"{steps[at] / step:.0f} steps wide{_times(len(wide))}"
    what = f"a gap: no samples from {time[at]:.9g} to {time[at + 1]:.9g} s, {width}"
    return Problem(file, row(at + 1), what, "split the file at the gap, or export the run again")


def _times(count: int) -> str:
    return f" ({count} times)" if count > 1 else ""
