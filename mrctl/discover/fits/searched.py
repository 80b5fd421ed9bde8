"""The rate at which records are searched, and how much of a run that repeats."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.noise.noise_floor import NoiseFloor
from mrctl.identify.base import in_blocks
from mrctl.identify.joint import WEIGHING_RATE_HZ
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record
from mrctl.measurements.refine import refinement

Array = NDArray[np.float64]

SEARCHED_SAMPLES = 20000  # of runs that repeat, where there are more
SLOWEST_HZ, FASTEST_HZ = 800.0, 1000.0  # slower runs are refined, faster ones averaged; ...
LONG_S = 120.0  # ... in a campaign longer than this at half these rates
FEWEST_CYCLES = 3  # of a run that repeats, to be searched
RUN_OUT = 1.5  # cycles that may follow the steady ones: the motion's end, and a cycle that is not whole
LONGEST_S = 10.0  # a longer run may be heating up, ...
DRIFTING = 0.5  # ... and one that drifts this much, in RMS of its noise, is
UNRESOLVED = 0.005  # of a record's RMS force, that a finer rate changes in it; ...
BORNE_OUT = 0.25  # ... and of the mean square of that, what the measured force is better met by


def at_search_rates(
    measured: Sequence[Record],
    floors: Sequence[NoiseFloor],
    timing: Callable[[list[Record]], list[Record]],
    times: Sequence[int] = (),
) -> tuple[list[Record], list[Record]]:
    """The records whole and refined, their steps as `timing` has them; and shorter, at the search's rate.

    times: as high a rate as usual for each, but none is refined beyond the slowest of a short campaign.
    """
    share = SEARCHED_SAMPLES / (_seconds(measured) * WEIGHING_RATE_HZ)
    fewer = _seconds([shortened(r, f, share) for r, f in zip(measured, floors, strict=True)])
    by = [(0.5 if fewer > LONG_S else 1.0) * k for k in times or (1,) * len(measured)]
    full = timing(
        [
            r if r.slow > 1 else r.refined(refinement(r.rate_hz, min(k, 1.0) * SLOWEST_HZ))
            for r, k in zip(measured, by, strict=True)
        ]
    )
    records = [
        shortened(r, f, share).decimated(max(r.slow, int(r.rate_hz / (k * FASTEST_HZ))))
        for r, f, k in zip(full, floors, by, strict=True)
    ]
    return full, records


def unresolved(fit: JointFit, records: Sequence[Record], finer: Sequence[Record]) -> list[bool]:
    """Which records are too coarse for the model that was fitted to them, as finer ones foretell.

    Where the damper's knee is passed within a sample the force of the mean motion is not the mean force. The
    measured forces have to bear the finer ones out: a motion's noise, which means take away, looks like it.
    """
    forces = zip(*(fit.model.on(some).predict(fit.theta) for some in (records, finer)), strict=True)
    fast, gained, expected = [], 0.0, 0.0
    for coarse, fine, (own, finer_n) in zip(records, finer, forces, strict=True):
        there = _at_samples_of(coarse, fine, finer_n)
        seen = slice(fit.model.settle_blocks(fit.theta, coarse) * fit.model.factor(coarse), there.size)
        force, here, there = coarse.force_n[seen], own[seen], there[seen]
        apart = float(np.sum((here - there) ** 2))
        fast.append(apart > UNRESOLVED**2 * float(np.sum(force**2)))
        if fast[-1]:
            expected += apart
            gained += float(np.sum((force - here) ** 2) - np.sum((force - there) ** 2))
    return fast if gained > BORNE_OUT * expected else [False] * len(fast)


def _at_samples_of(coarse: Record, fine: Record, force_n: Array) -> Array:
    """A finer record's force at a coarser one's samples: one of several, or their mean, as that was made."""
    by = max(round(fine.rate_hz / coarse.rate_hz), 1)
    return in_blocks(force_n, by, picked=fine.finer > coarse.finer)[: len(coarse)]


def shortened(record: Record, floor: NoiseFloor, share: float) -> Record:
    """That share of a short run that repeats to its end, a few cycles at least; any other run whole.

    What is left away must be more of the same: not the next of several motions in one run.
    """
    steady = floor.steady
    if share >= 1.0 or steady is None or len(record) / record.rate_hz > LONGEST_S:
        return record
    if floor.floor_n and floor.drift_n and floor.drift_n > DRIFTING * floor.floor_n:
        return record
    end = steady.start + steady.count * steady.period
    if steady.samples - end > RUN_OUT * steady.period:
        return record
    kept = max(share * steady.samples, steady.start + FEWEST_CYCLES * steady.period)
    return record.part(0, int(kept * len(record) / steady.samples))


def _seconds(records: Sequence[Record]) -> float:
    return sum(len(r) / r.rate_hz for r in records)
