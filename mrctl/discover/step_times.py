"""When a stepped current really stepped: somewhere between two samples, and the file does not say where.

At 500 Hz a step is uncertain by 2 ms, and a damper that goes over in a few of them then seems to miss by
hundreds of newtons. The time of each step that stands alone is taken from the force: as a share of the
sampling interval around its middle, held to what a uniform spread expects. Half an interval is as much as
that can hide of a coil's lag; once a lag is found, the times are taken anew with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.joint import JointFit
from mrctl.identify.noise import correlation_inflation
from mrctl.identify.records import Record

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

LEAST_STEP = 0.03  # of the campaign's range of current
REST_STEP = 0.1  # of the step: what the samples beside it may move
ALONE_S = 0.05  # without another step: what one did to the force is over by then
TRIED = 0.25  # of an interval: the shift by which the slope is taken
SPREAD = 12.0**-0.5  # of a time that is uniform over one interval
MOST = 0.5  # of an interval, to either side


def timed(records: Sequence[Record], fit: JointFit) -> list[Record]:
    """The records, with the sample before each step moved so that the current's integral is right.

    records: as measured. fit: a model of them, at whatever rate it was fitted.
    """
    low = min(float(r.current_a.min()) for r in records)
    least = LEAST_STEP * (max(float(r.current_a.max()) for r in records) - low)
    places = [lone_steps(r, least) if least > 0.0 else np.zeros(0, dtype=np.intp) for r in records]
    if not any(p.size for p in places):
        return list(records)
    tried = [_shifted(r, at, np.full(at.size, TRIED)) for r, at in zip(records, places, strict=True)]
    plain = fit.model.on(records).errors(fit.theta)
    moved = fit.model.on(tried).errors(fit.theta)
    return [
        _shifted(r, at, _shares(r, at, error, (error - other) / TRIED))
        for r, at, error, other in zip(records, places, plain, moved, strict=True)
    ]


def lone_steps(record: Record, least_a: float) -> Ints:
    """The last samples before steps of at least this size with no other change near."""
    jumps = np.abs(np.diff(record.current_a))
    at = np.flatnonzero(jumps >= least_a)
    span = max(1, round(ALONE_S * record.rate_hz))
    kept = []
    for k in at:
        beside = np.concatenate([jumps[max(0, k - span) : k], jumps[k + 1 : k + 1 + span]])
        if k > 0 and beside.size and float(beside.max()) <= REST_STEP * jumps[k]:
            kept.append(k)
    return np.array(kept, dtype=np.intp)


def _shares(record: Record, at: Ints, error: Array, slope: Array) -> Array:
    """How much earlier than the middle of its interval each step is, in intervals, within a half."""
    span = max(1, round(ALONE_S * record.rate_hz))
    noise = (1.4826 * float(np.median(np.abs(error)))) ** 2 * correlation_inflation(error)
    shares = np.zeros(at.size)
    for n, k in enumerate(at):
        near = slice(max(0, k - 1), k + span)
        push, size = float(slope[near] @ error[near]), float(slope[near] @ slope[near])
        if size > 0.0:
            shares[n] = push / (size + noise / SPREAD**2)
    return np.clip(shares, -MOST, MOST)


def _shifted(record: Record, at: Ints, shares: Array) -> Record:
    current = record.current_a.copy()
    current[at] += shares * (record.current_a[at + 1] - record.current_a[at])
    return replace(record, current_a=current)
