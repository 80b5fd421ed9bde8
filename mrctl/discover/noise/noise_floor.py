"""The noise floor of a measured run: what differs between cycles in which the damper did the same.

Cycles are found from the motion. The force of neighbouring cycles is compared at equal phase by second
differences (1, -2, 1): whatever repeats, drifts evenly (a heating damper) or slips in phase evenly drops
out, and for noise that forgets within a cycle, of any colour, its mean square is six times the noise's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, rfft
from scipy.interpolate import CubicSpline

from mrctl.identify.noise import correlation_inflation
from mrctl.measurements.derivative import noise_sigma
from mrctl.measurements.run import Run

Array = NDArray[np.float64]

FEWEST_CYCLES = 3
SAMPLES_PER_CYCLE = 16
AMPLITUDE_TOLERANCE = 0.02  # of the median cycle's
PHASE_TOLERANCE = 0.01  # cycles
MOTION_TOLERANCE = 0.05  # what of the motion may not repeat, of its RMS
CURRENT_TOLERANCE_A = 0.03
TEMPERATURE_TOLERANCE_C = 1.0  # from one cycle to the next


@dataclass(frozen=True, slots=True)
class NoiseFloor:
    """What is known of a run's noise; `floor_n` is None where nothing repeats.

    lower_bound_n: noise from sample to sample; coloured noise is larger. drift_n: RMS of slow change between
    cycles, which is no noise. effective_samples: how many independent samples the run is worth.
    """

    floor_n: float | None
    method: Literal["cycles", "lower bound only"]
    lower_bound_n: float
    cycles: int = 0
    effective_samples: float | None = None
    drift_n: float | None = None
    steady: Cycles | None = None

    def unrepeated(self, values: Array) -> float | None:
        """The mean square of what does not repeat in values (n) that end with the run; None if unknown."""
        if self.steady is None:
            return None
        left = self.steady.of_the_last(values.size)
        return None if left is None else float(np.mean(_bends(_folded(values, left)) ** 2))


@dataclass(frozen=True, slots=True)
class Cycles:
    """Whole steady cycles: the first one's start and the period, both in samples, and their number."""

    start: float
    period: float
    count: int
    samples: int  # of the run they are in

    def of_the_last(self, samples: int) -> Cycles | None:
        """Those in the run's last samples, counted from there; None for fewer than three."""
        start = self.start - (self.samples - samples)
        gone = max(0, int(np.ceil(-start / self.period)))
        if self.count - gone < FEWEST_CYCLES:
            return None
        return Cycles(start + gone * self.period, self.period, self.count - gone, samples)


def noise_floor(run: Run) -> NoiseFloor:
    """The noise of a run's force from cycle to cycle; without three steady cycles only a lower bound."""
    quantum = quantisation_step(run.force_n)
    least = quantum / np.sqrt(12.0)
    bound = max(float(noise_sigma(run.force_n)), least)
    cycles = find_cycles(run)
    if cycles is None:
        return NoiseFloor(None, "lower bound only", bound)
    force = _folded(run.force_n, cycles)
    bends = _bends(force)
    variance = float(np.mean(bends**2))
    spread = float(np.sum((force - force.mean(axis=0)) ** 2)) / ((cycles.count - 1) * force.shape[1])
    inflation = float(np.median([correlation_inflation(row) for row in bends]))
    return NoiseFloor(
        max(float(np.sqrt(variance)), least),
        "cycles",
        bound,
        cycles.count,
        len(run) / inflation,
        float(np.sqrt(max(spread - variance, 0.0))),
        cycles,
    )


def _bends(folded: Array) -> Array:
    """What does not repeat in (cycles, phases), nor drifts: of white noise, its own size."""
    return np.asarray(np.diff(folded, n=2, axis=0) / np.sqrt(6.0))


def pooled_floor(floors: list[NoiseFloor], sizes: list[int]) -> float | None:
    """The noise in N over all runs where it is known, weighted by samples; None where it is in none."""
    known = [(f.floor_n, n) for f, n in zip(floors, sizes, strict=True) if f.floor_n is not None]
    if not known:
        return None
    return float(np.sqrt(sum(n * f * f for f, n in known) / sum(n for _, n in known)))


def find_cycles(run: Run) -> Cycles | None:
    """The longest stretch of steady cycles with steady current and temperature; None for fewer than three."""
    velocity = run.velocity_m_s - run.velocity_m_s.mean()
    period = _period(velocity)
    if period is None:
        return None
    starts = np.arange(0.0, len(run) - period, period)
    phasors = _phasors(velocity, starts, period)
    size = np.abs(phasors)
    for _ in range(3):  # the phase's slope from cycle to cycle corrects the period
        good = size > 0.5 * np.median(size)
        if np.count_nonzero(good) < FEWEST_CYCLES:
            return None
        phase = np.unwrap(np.angle(phasors[good])) / (2.0 * np.pi)
        steps = np.diff(phase) / np.diff(np.flatnonzero(good))
        period /= 1.0 + float(np.median(steps))
        starts = np.arange(0.0, len(run) - period, period)
        if starts.size < FEWEST_CYCLES:
            return None
        phasors = _phasors(velocity, starts, period)
        size = np.abs(phasors)
    starts = starts[starts + period <= len(run) - 1]
    size, phase = size[: starts.size], np.unwrap(np.angle(phasors[: starts.size])) / (2.0 * np.pi)
    current, warm = (_means(x, starts, period) for x in (run.current_a, run.temperature_c))
    swing = np.array([_spread(run.current_a, s, period) for s in starts])
    joins = (
        (np.abs(np.diff(size)) < AMPLITUDE_TOLERANCE * np.median(size))
        & (np.abs(np.diff(phase)) < PHASE_TOLERANCE)
        & (np.abs(np.diff(current)) < CURRENT_TOLERANCE_A)
        & (np.abs(np.diff(warm)) < TEMPERATURE_TOLERANCE_C)
        & (np.maximum(swing[1:], swing[:-1]) < CURRENT_TOLERANCE_A)
    )
    first, last = _longest(joins)
    if first == 0 and last >= FEWEST_CYCLES:  # in a run's first cycle the damper settles
        first = 1
    cycles = Cycles(float(starts[first]), period, last - first + 1, len(run)) if starts.size else None
    if cycles is None or cycles.count < FEWEST_CYCLES:
        return None
    motion = _folded(velocity, cycles)
    rest = np.sqrt(np.mean(np.diff(motion, n=2, axis=0) ** 2) / 6.0)
    return cycles if rest < MOTION_TOLERANCE * np.sqrt(np.mean(motion**2)) else None


def quantisation_step(values: Array) -> float:
    """The step of a coarse converter in the values' unit; 0 where values do not lie on a grid."""
    levels = np.unique(values)
    if levels.size < 2 or levels.size > values.size // 4:
        return 0.0
    step = float(np.min(np.diff(levels)))
    places = (levels - levels[0]) / step
    return step if float(np.max(np.abs(places - np.round(places)))) < 0.02 else 0.0


def _period(velocity: Array) -> float | None:
    """The period of the strongest line in samples; None without three periods or for a motion at rest."""
    n = velocity.size
    power = np.abs(np.fft.rfft(velocity * np.hanning(n), 4 * n)) ** 2
    power[: 4 * FEWEST_CYCLES] = 0.0
    at = int(np.argmax(power))
    if power[at] <= 0.0 or 4.0 * n / at < SAMPLES_PER_CYCLE:
        return None
    return 4.0 * n / at


def _phasors(values: Array, starts: Array, period: float) -> NDArray[np.complex128]:
    """The fundamental of each cycle; phases refer to the cycle's own start."""
    count = int(period)
    rows = np.minimum(np.round(starts).astype(int)[:, None] + np.arange(count), values.size - 1)
    turns = (rows - starts[:, None]) / period
    return np.asarray((values[rows] * np.exp(-2j * np.pi * turns)).mean(axis=1))


def _means(values: Array, starts: Array, period: float) -> Array:
    return np.array([values[int(s) : int(s + period)].mean() for s in starts])


def _spread(values: Array, start: float, period: float) -> float:
    """The standard deviation, doubled: a sensor's noise is no swing."""
    return 2.0 * float(values[int(start) : int(start + period)].std())


def _longest(joins: NDArray[np.bool_]) -> tuple[int, int]:
    """First and last cycle of the longest chain whose neighbours agree."""
    best, first = (0, 0), 0
    for k, joined in enumerate(joins, 1):
        if not joined:
            first = k
        if k - first > best[1] - best[0]:
            best = (first, k)
    return best


def _folded(values: Array, cycles: Cycles) -> Array:
    """The values at equal phases, (cycles, phases).

    Band-limited: fourfold by the spectrum, mirrored at both ends, then a spline; the noise keeps its power,
    which interpolation between neighbours would lessen.
    """
    n = values.size
    pad = min(n - 1, 256)
    longer = np.concatenate(
        (2 * values[0] - values[pad:0:-1], values, 2 * values[-1] - values[-2 : -pad - 2 : -1])
    )
    ramp = np.linspace(longer[0], longer[-1], longer.size)
    fine = _fourfold(longer - ramp)
    slope = (longer[-1] - longer[0]) / (longer.size - 1)
    count = int(np.ceil(cycles.period))
    at = cycles.start + (np.arange(cycles.count)[:, None] + np.arange(count) / count) * cycles.period
    spline = CubicSpline(np.arange(fine.size) / 4.0 - pad, fine)
    return np.asarray(spline(at) + longer[0] + slope * (at + pad), dtype=np.float64)


def _fourfold(values: Array) -> Array:
    """The values (n) at four times as many places, by their spectrum."""
    spectrum = rfft(values)
    if values.size % 2 == 0:
        spectrum[-1] *= 0.5  # which stood for both of its kind
    return np.asarray(4.0 * irfft(spectrum, 4 * values.size), dtype=np.float64)
