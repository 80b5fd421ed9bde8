"""The rate at which records are searched, and how much of a run that repeats."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mrctl.discover.noise.noise_floor import NoiseFloor
from mrctl.identify.joint import WEIGHING_RATE_HZ
from mrctl.identify.records import Record
from mrctl.measurements.refine import refinement

SEARCHED_SAMPLES = 20000  # of runs that repeat, where there are more
SLOWEST_HZ, FASTEST_HZ = 800.0, 1000.0  # slower runs are refined, faster ones averaged; ...
LONG_S = 120.0  # ... in a campaign longer than this at half these rates
FEWEST_CYCLES = 3  # of a run that repeats, to be searched
RUN_OUT = 1.5  # cycles that may follow the steady ones: the motion's end, and a cycle that is not whole
LONGEST_S = 10.0  # a longer run may be heating up, ...
DRIFTING = 0.5  # ... and one that drifts this much, in RMS of its noise, is


def at_search_rates(
    measured: Sequence[Record],
    floors: Sequence[NoiseFloor],
    timing: Callable[[list[Record]], list[Record]],
) -> tuple[list[Record], list[Record]]:
    """The records whole and refined, their steps as `timing` has them; and shorter, at the search's rate."""
    share = SEARCHED_SAMPLES / (_seconds(measured) * WEIGHING_RATE_HZ)
    fewer = _seconds([shortened(r, f, share) for r, f in zip(measured, floors, strict=True)])
    by = 0.5 if fewer > LONG_S else 1.0
    slowest, fastest = by * SLOWEST_HZ, by * FASTEST_HZ
    full = timing([r if r.slow > 1 else r.refined(refinement(r.rate_hz, slowest)) for r in measured])
    records = [
        shortened(r, f, share).decimated(max(r.slow, int(r.rate_hz / fastest)))
        for r, f in zip(full, floors, strict=True)
    ]
    return full, records


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
