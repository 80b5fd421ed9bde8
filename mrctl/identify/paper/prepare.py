"""Sec. 5.1: a low-pass over force and velocity, and the cycles at start and end taken away.

The filter runs forwards and backwards over force and velocity alike. The paper does not say whether its
filter was causal; its result does: a causal filter on the force alone would put 9.7 degrees and 11 ms into
H at the motion's 2.387 Hz, where Eq. 6.4 has 3.2 degrees and 4 ms; on both, it would still turn their
harmonics by different times. Without phase, none is invented. Both passes together have the named cut-off
(-3 dB).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from mrctl.errors import InputError, Problem
from mrctl.identify.paper.options import PaperOptions
from mrctl.measurements.run import Campaign, Run

Array = NDArray[np.float64]

STEADY_A = 0.1  # a current that moves less during a run is one level
STEADY_SHARE = 0.05  # or less than this share of the campaign's largest
REST_SHARE = 0.02  # of its peak: a slower velocity is rest
TURN_SHARE = (
    0.2  # a cycle begins where the velocity has gone from this share of its peak, negative, to positive
)
TWO_PASSES = (2.0**0.5 - 1.0) ** 0.25  # cut-off of two passes over that of one, at second order
SHORTEST_S = 0.1  # of a record that says anything at 20 Hz


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """A run after Sec. 5.1: filtered (n each) on an even clock; `kept` are the samples left by the trimming.

    What lies before `kept` is the past that the tapped delay line (Eq. 6.2) starts from.
    """

    name: str
    run: int  # its place in the campaign
    time_s: Array
    velocity_m_s: Array
    force_n: Array
    current_a: float
    temperature_c: float  # mean over the kept samples
    kept: slice
    cycles: int  # whole cycles kept; 0 where the motion has none

    def cut(self, values: Array) -> Array:
        """The kept samples of something as long as the record."""
        return values[self.kept]


@dataclass(frozen=True, slots=True, eq=False)
class Preparation:
    """All runs after Sec. 5.1, and those that this method cannot use, each with the reason."""

    root: Path  # where the campaign lies, for messages
    sample_rate_hz: float
    records: tuple[Record, ...]
    left_out: tuple[Problem, ...]


def prepare(campaign: Campaign, options: PaperOptions) -> Preparation:
    """Filter and trim each run. Raises InputError where no run is left."""
    largest_a = max((float(np.max(run.current_a)) for run in campaign.runs), default=0.0)
    records: list[Record] = []
    left_out: list[Problem] = []
    for number, run in enumerate(campaign.runs):
        reason = _unfit(run, largest_a, options)
        if reason:
            left_out.append(Problem(str(run.file), None, *reason))
        else:
            records.append(_record(number, run, options))
    if not records:
        raise InputError(
            left_out or [Problem(str(campaign.root), None, "holds no runs", "name a folder of runs")]
        )
    return Preparation(campaign.root, options.sample_rate_hz, tuple(records), tuple(left_out))


def _unfit(run: Run, largest_a: float, options: PaperOptions) -> tuple[str, str] | None:
    """Why the method cannot use a run, and the mend."""
    if not (run.has_force and run.has_current):
        return "lacks force or current", "record both"
    low, high = np.quantile(run.current_a, (0.02, 0.98))
    if high - low > max(STEADY_A, STEADY_SHARE * largest_a):
        return (
            f"current goes from {low:.3g} to {high:.3g} A, the paper's method needs it constant",
            "use `--method best`, or record each current by itself",
        )
    if run.sample_rate_hz <= 2.5 * options.cutoff_hz:
        return (
            f"sampled at {run.sample_rate_hz:.3g} Hz, too slow for the {options.cutoff_hz:g} Hz low-pass",
            f"sample at {5.0 * options.cutoff_hz:g} Hz or more",
        )
    if len(run) * run.dt_s < SHORTEST_S:
        return f"lasts {len(run) * run.dt_s:.2g} s only", "record some cycles"
    if not (np.min(run.velocity_m_s) < 0.0 < np.max(run.velocity_m_s)):
        return "moves in one direction only", "record whole cycles"
    return None


def _record(number: int, run: Run, options: PaperOptions) -> Record:
    velocity = _lowpass(run.velocity_m_s, run.sample_rate_hz, options.cutoff_hz)
    force = _lowpass(run.force_n, run.sample_rate_hz, options.cutoff_hz)
    rate = options.sample_rate_hz
    count = int((len(run) - 1) * run.dt_s * rate + 1e-6) + 1
    time = np.arange(count) / rate
    if abs(run.sample_rate_hz - rate) > 1e-6 * rate:
        own = np.arange(len(run)) * run.dt_s
        velocity, force = (CubicSpline(own, x)(time) for x in (velocity, force))
    kept, cycles = trim(velocity, options)
    start, stop = (int(k * len(run) / count) for k in (kept.start, kept.stop))
    return Record(
        name=run.name,
        run=number,
        time_s=run.time_s[0] + time,
        velocity_m_s=velocity,
        force_n=force,
        current_a=float(np.median(run.current_a)),
        temperature_c=float(np.mean(run.temperature_c[start:stop])),
        kept=kept,
        cycles=cycles,
    )


def _lowpass(x: Array, rate_hz: float, cutoff_hz: float) -> Array:
    each = min(cutoff_hz / TWO_PASSES, 0.45 * rate_hz)
    sections = butter(2, each, fs=rate_hz, output="sos")
    pad = min(x.size - 1, int(3.0 * rate_hz / cutoff_hz))
    return np.asarray(sosfiltfilt(sections, x, padlen=pad), dtype=np.float64)


def trim(velocity_m_s: Array, options: PaperOptions) -> tuple[slice, int]:
    """The samples that stay, whole cycles: without the first and last ones, as far as there are enough.

    Cycles are counted from where the motion begins, at the mean distance of the velocity's upward zeros; rest
    before and after goes. Motion without a cycle stays as it is.
    """
    starts = cycle_starts(velocity_m_s)
    if starts.size < 2:
        return slice(0, velocity_m_s.size), 0
    period = float(starts[-1] - starts[0]) / (starts.size - 1)
    moving = np.flatnonzero(np.abs(velocity_m_s) > REST_SHARE * np.max(np.abs(velocity_m_s)))
    begin, end = float(moving[0]), float(moving[-1] + 1)
    cycles = int((end - begin) / period + 0.1)
    first, last = options.drop_first_cycles, options.drop_last_cycles
    if cycles < first + last + 1:  # too few to be choosy: the first one only, if there is another
        first, last = (1, 0) if cycles > 1 else (0, 0)
    kept = max(cycles - first - last, 1)
    start = min(begin + first * period, velocity_m_s.size - kept * period)
    return slice(max(round(start), 0), min(round(start + kept * period), velocity_m_s.size)), kept


def cycle_starts(velocity_m_s: Array) -> NDArray[np.intp]:
    """Where the velocity goes through zero upwards, having been clearly below and going clearly above."""
    level = TURN_SHARE * float(np.max(np.abs(velocity_m_s)))
    side = np.where(velocity_m_s > level, 1, np.where(velocity_m_s < -level, -1, 0))
    clear = np.flatnonzero(side)
    ups = np.flatnonzero((side[clear[:-1]] < 0) & (side[clear[1:]] > 0))
    starts = []
    for k in ups:
        low, high = clear[k], clear[k + 1]
        starts.append(low + 1 + int(np.argmax(velocity_m_s[low + 1 : high + 1] >= 0.0)))
    return np.asarray(starts, dtype=np.intp)
