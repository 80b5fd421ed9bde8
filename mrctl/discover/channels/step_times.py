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

from mrctl.discover.channels.dense_steps import MOST_AT_ONCE, UNIFORM, at_once, dense_steps, shares_of
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.noise import usual_n2
from mrctl.identify.records import Record

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

LEAST_STEP = 0.03  # of the campaign's range of current
REST_STEP = 0.1  # of the step: what the samples beside it may move
ALONE_S = 0.05  # without another step: what one did to the force is over by then
TRIED = np.linspace(-0.5, 0.5, 9)  # of an interval, earlier than its middle
MOST_HIDDEN = 0.2  # of a record's samples
AFTER_S, MOST_AFTER = 0.005, 3  # and samples, in which the force shows when within its interval a step was


def timed(records: Sequence[Record], fit: JointFit) -> list[Record]:
    """The records with each step where the force says that it was, at whatever rate they are refined to.

    records: with the current as it was measured. fit: a model of them, at whatever rate it was fitted.
    """
    low = min(float(r.current_a.min()) for r in records)
    least = LEAST_STEP * (max(float(r.current_a.max()) for r in records) - low)
    if least <= 0.0:
        return list(records)
    alone = [lone_steps(r, least) for r in records]
    together = [_steps_together(r, least, at) for r, at in zip(records, alone, strict=True)]
    return _timed_together(_timed_alone(records, fit, alone), fit, together)


def _timed_alone(records: Sequence[Record], fit: JointFit, places: Sequence[Ints]) -> list[Record]:
    """With the times of those steps after which the current rests for longer than the force answers."""
    if not any(p.size for p in places):
        return list(records)
    tried = []
    for share in TRIED:
        here = _placed(records, places, [np.full(p.size, share) for p in places])
        tried.append(fit.model.on(here).errors(fit.theta))
    shares = [
        _shares(r, at, np.stack([e[:: r.finer] for e in own]))
        for r, at, own in zip(records, places, zip(*tried, strict=True), strict=True)
    ]
    return _placed(records, places, shares)


def _timed_together(records: Sequence[Record], fit: JointFit, places: Sequence[Ints]) -> list[Record]:
    """With the times of the steps that come while the force still answers to the last one."""
    if not any(p.size for p in places):
        return list(records)

    def errors(shares: Sequence[Array]) -> list[Array]:
        here = _placed(records, places, shares)
        found = fit.model.on(here).errors(fit.theta)
        return [e[:: r.finer] for e, r in zip(found, here, strict=True)]

    return _placed(records, places, shares_of(places, [_span(r) for r in records], errors))


def _steps_together(record: Record, least_a: float, alone: Ints) -> Ints:
    """The last measured samples before steps that are not alone; none where too many answers meet."""
    at = np.setdiff1d(dense_steps(_jumps(record), least_a), alone)
    return at if at_once(at, _span(record)) <= MOST_AT_ONCE else at[:0]


def _jumps(record: Record) -> Array:
    """How far the current goes from one measured sample to the next, A."""
    return np.abs(np.diff(record.current_a[:: record.finer]))


def _span(record: Record) -> int:
    """The measured samples in which the force answers to a step."""
    return max(1, round(ALONE_S * record.rate_hz / record.finer))


def trusted(records: Sequence[Record], factors: Sequence[int]) -> list[Array]:
    """1 for each weighed sample of the records, 0 where a step's time is not known: (n // factor) each."""
    found = []
    for r, factor in zip(records, factors, strict=True):
        trust = np.ones(len(r) // factor)
        hidden = _after_steps(r, len(r)) * r.finer // factor
        trust[hidden[hidden < trust.size]] = 0.0
        found.append(trust)
    return found


def without_steps(record: Record, error: Array) -> Array:
    """A model's error (n measured samples, to the record's end), straight over the moments after steps.

    There it hangs on when between two samples the current stepped, and no model knows.
    """
    hidden = _after_steps(record, error.size)
    if not hidden.size:
        return error
    seen = np.setdiff1d(np.arange(error.size), hidden)
    return np.asarray(np.interp(np.arange(error.size), seen, error[seen]))


def _after_steps(record: Record, size: int) -> Ints:
    """The samples after steps, of the last `size` that were measured; none where there are too many."""
    current = record.current_a[:: record.finer]
    size = min(size, current.size)
    jumps = np.abs(np.diff(current))
    if not jumps.any():
        return np.zeros(0, dtype=np.intp)
    rate = record.rate_hz / record.finer
    at = np.flatnonzero(jumps >= LEAST_STEP * float(np.ptp(current))) + 1 - (current.size - size)
    count = min(max(1, int(np.ceil(AFTER_S * rate))), MOST_AFTER)
    hidden = np.unique(at[:, None] + np.arange(count))
    hidden = hidden[(hidden > 0) & (hidden < size - 1)]
    # What changes in many samples on end is a slope, not a step.
    return hidden if hidden.size <= MOST_HIDDEN * size else np.zeros(0, dtype=np.intp)


def lone_steps(record: Record, least_a: float) -> Ints:
    """The last measured samples before steps of at least this size with no other change near."""
    jumps = _jumps(record)
    at = np.flatnonzero(jumps >= least_a)
    span = _span(record)
    kept = []
    for k in at:
        beside = np.concatenate([jumps[max(0, k - span) : k], jumps[k + 1 : k + 1 + span]])
        if k > 0 and beside.size and float(beside.max()) <= REST_STEP * jumps[k]:
            kept.append(k)
    return np.array(kept, dtype=np.intp)


def _shares(record: Record, at: Ints, errors: Array) -> Array:
    """How much earlier than the middle of its interval each step is, in intervals, within a half.

    errors (tried shares, n): what a model misses with all steps at a share. The force does not answer to the
    time of a step in a straight line: so the least error is looked up, not stepped to.
    """
    span = _span(record)
    out, between = np.zeros(at.size), TRIED[1] - TRIED[0]
    for n, k in enumerate(at):
        near = errors[:, max(0, k - 1) : k + span]
        best = near[int(np.argmin(np.sum(near**2, axis=1)))]
        loss = np.sum(near**2, axis=1) + usual_n2(best) * UNIFORM * TRIED**2
        least = int(np.argmin(loss))
        out[n] = TRIED[least]
        if 0 < least < TRIED.size - 1:
            before, here, after = loss[least - 1 : least + 2]
            out[n] += 0.5 * between * (before - after) / max(before - 2.0 * here + after, 1e-300)
    return out


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
