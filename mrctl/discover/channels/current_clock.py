"""A current that the file has later than the force: a channel's own delay, since no coil answers early.

Left in, it makes up for a part of every lag, and the rest is taken for a damper's memory. Only what changes
smoothly shows it: between two samples a step may be anywhere (`step_times`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.tangent import Tangent
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.noise import correlation_inflation
from mrctl.identify.records import Record

Array = NDArray[np.float64]

TRIED_S = 1e-3
LEAST_S, MOST_S = 2e-4, 5e-3
WORTH = 0.02  # of the square sum, that it must take off
CERTAIN = 5.0  # standard errors
MOVES_A = 0.05  # less of a campaign's current is steady
STEPS = 0.1  # of a record's range of current, in one measured sample
ANSWERED_S = 0.05  # after a step, when it was no longer shows


def current_late_s(fit: JointFit) -> float:
    """How much later than the force says the current was written, in s; 0 where that is not certain.

    fit: of a base, whose own filter takes up what is late with the velocity as well.
    """
    model = fit.model
    if all(float(np.ptp(r.current_a)) < MOVES_A for r in model.records):
        return 0.0
    tangent = Tangent.of(fit)
    smooth = np.concatenate(
        [_smooth(r, model.factor(r))[skip:] for r, skip in zip(model.records, tangent.skips, strict=True)]
    )
    residual = smooth * tangent.residual
    here = tangent.stacked(model.predict(fit.theta))
    moved = [replace(r, current_a=_advanced(r, TRIED_S)) for r in model.records]
    there = tangent.stacked(model.on(moved).predict(fit.theta))
    slope = smooth * tangent.beyond(there - here) / TRIED_S
    square = float(slope @ slope)
    if square <= 0.0:
        return 0.0
    late = float(slope @ residual) / square
    gain = late * late * square
    left = (float(residual @ residual) - gain) / float(smooth.sum())
    error = float(np.sqrt(max(left, 0.0) * correlation_inflation(slope * residual) / square))
    worth = gain > WORTH * float(residual @ residual)
    return min(late, MOST_S) if late > max(LEAST_S, CERTAIN * error) and worth else 0.0


def earlier(record: Record, by_s: float) -> Record:
    """The record with its current earlier; by whole samples where it steps, so that a step stays one."""
    by = by_s * record.rate_hz / record.finer
    if _jumps(record).any():
        by = float(round(by))
    return replace(record, current_a=_advanced(record, by * record.finer / record.rate_hz))


def _advanced(record: Record, by_s: float) -> Array:
    at = np.arange(len(record), dtype=np.float64)
    return np.asarray(np.interp(at + by_s * record.rate_hz, at, record.current_a))


def _jumps(record: Record) -> NDArray[np.bool_]:
    """Where from one measured sample to the next the current steps (samples - 1)."""
    measured = record.current_a[:: record.finer]
    return np.asarray(np.abs(np.diff(measured)) > max(STEPS * float(np.ptp(measured)), MOVES_A))


def _smooth(record: Record, factor: int) -> Array:
    """1 for each weighed sample (n // factor) away from steps of the current, else 0."""
    count = len(record) // factor
    after = int(np.ceil(ANSWERED_S * record.rate_hz))
    free = np.ones(len(record))
    for k in np.flatnonzero(_jumps(record)) * record.finer:
        free[k : k + record.finer + after] = 0.0
    return np.asarray(free[: count * factor].reshape(count, factor).min(axis=1))
