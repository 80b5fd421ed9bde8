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

from mrctl.identify.joint_fit import JointFit
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
PASSES = 2
MOST_HIDDEN = 0.2  # of a record's samples
AFTER_S, MOST_AFTER = 0.005, 3  # and samples, in which the force shows when within its interval a step was


def timed(records: Sequence[Record], fit: JointFit) -> list[Record]:
    """The records with each step where the force says that it was, at whatever rate they are refined to.

    records: with the current as it was measured. fit: a model of them, at whatever rate it was fitted.
    """
    low = min(float(r.current_a.min()) for r in records)
    least = LEAST_STEP * (max(float(r.current_a.max()) for r in records) - low)
    places = [lone_steps(r, least) if least > 0.0 else np.zeros(0, dtype=np.intp) for r in records]
    if not any(p.size for p in places):
        return list(records)
    shares = [np.zeros(p.size) for p in places]
    for _ in range(PASSES):
        here = _placed(records, places, shares)
        # Towards the middle, so that the trial stays within the interval.
        by = [np.where(s > 0.0, -TRIED, TRIED) for s in shares]
        there = _placed(records, places, [s + d for s, d in zip(shares, by, strict=True)])
        errors, others = fit.model.on(here).errors(fit.theta), fit.model.on(there).errors(fit.theta)
        shares = [
            _shares(r, at, (e - other)[:: r.finer], e[:: r.finer], s, d)
            for r, at, e, other, s, d in zip(records, places, errors, others, shares, by, strict=True)
        ]
    return _placed(records, places, shares)


def without_steps(record: Record, error: Array) -> Array:
    """A model's error (n measured samples, to the record's end), straight over the moments after steps.

    There it hangs on when between two samples the current stepped, and no model knows.
    """
    current = record.current_a[:: record.finer]
    jumps = np.abs(np.diff(current))
    if not jumps.any():
        return error
    rate = record.rate_hz / record.finer
    at = np.flatnonzero(jumps >= LEAST_STEP * float(np.ptp(current))) + 1 - (current.size - error.size)
    count = min(max(1, int(np.ceil(AFTER_S * rate))), MOST_AFTER)
    hidden = (at[:, None] + np.arange(count)).ravel()
    hidden = hidden[(hidden > 0) & (hidden < error.size - 1)]
    # What changes in many samples on end is a slope, not a step.
    if hidden.size > MOST_HIDDEN * error.size:
        return error
    seen = np.setdiff1d(np.arange(error.size), hidden)
    return np.asarray(np.interp(np.arange(error.size), seen, error[seen]))


def lone_steps(record: Record, least_a: float) -> Ints:
    """The last measured samples before steps of at least this size with no other change near."""
    jumps = np.abs(np.diff(record.current_a[:: record.finer]))
    at = np.flatnonzero(jumps >= least_a)
    span = max(1, round(ALONE_S * record.rate_hz / record.finer))
    kept = []
    for k in at:
        beside = np.concatenate([jumps[max(0, k - span) : k], jumps[k + 1 : k + 1 + span]])
        if k > 0 and beside.size and float(beside.max()) <= REST_STEP * jumps[k]:
            kept.append(k)
    return np.array(kept, dtype=np.intp)


def _shares(record: Record, at: Ints, change: Array, error: Array, shares: Array, tried: Array) -> Array:
    """How much earlier than the middle of its interval each step is, in intervals, within a half.

    change (n): what a trial, earlier by `tried`, takes off the error (n) that the shares so far leave.
    """
    rate = record.rate_hz / record.finer
    span = max(1, round(ALONE_S * rate))
    noise = (1.4826 * float(np.median(np.abs(error)))) ** 2 * correlation_inflation(error)
    out = np.zeros(at.size)
    for n, k in enumerate(at):
        near = slice(max(0, k - 1), k + span)
        slope = change[near] / tried[n]
        push, size = float(slope @ error[near]), float(slope @ slope)
        if size > 0.0:
            out[n] = (push + size * shares[n]) / (size + noise / SPREAD**2)
    return np.clip(out, -MOST, MOST)


def _placed(records: Sequence[Record], places: Sequence[Ints], shares: Sequence[Array]) -> list[Record]:
    return [_stepped(r, at, s) for r, at, s in zip(records, places, shares, strict=True)]


def _stepped(record: Record, at: Ints, shares: Array) -> Record:
    """The record with its steps at these times, one sample of each moved so that the integral is right."""
    current, n = record.current_a.copy(), record.finer
    for k, share in zip(at, shares, strict=True):
        first, last = k * n, (k + 1) * n
        old, new = current[first], current[last]
        place = n * (0.5 - share)
        whole = min(int(place), n - 1)
        rest = place - whole - 0.5  # later than the middle of its fine interval
        before = first + whole
        current[first : before + 1], current[before + 1 : last + 1] = old, new
        if rest < 0.0:
            current[before] -= rest * (new - old)
        else:
            current[before + 1] -= rest * (new - old)
    return replace(record, current_a=current)
