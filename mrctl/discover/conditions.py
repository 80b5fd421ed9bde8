"""Where a model fails: the residual by what the damper was doing, with tests that coloured noise passes.

Samples that follow one another are not independent. So each run is cut into blocks, longer than the
residual remembers, and a bin counts as worse than the average only by how its blocks agree on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from mrctl.discover.fits.signals import current_rate_a_s
from mrctl.identify.noise import correlation_inflation
from mrctl.measurements.run import Run

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

BINS = 8
FEWEST_BLOCKS = 6
LEAST_SCORE = 4.0  # standard errors above the average: some 70 bins are tried
LEAST_RATIO = 1.1  # of the average RMSE: less is not worth a sentence
MOST_BLOCKS = 64
NESTED_SHARE = 0.9


@dataclass(frozen=True, slots=True)
class Variable:
    """What the error is sorted by."""

    name: str
    unit: str
    words: str


VARIABLES = (
    Variable("velocity_m_s", "m/s", "velocity"),
    Variable("displacement_m", "m", "stroke"),
    Variable("acceleration_m_s2", "m/s^2", "acceleration"),
    Variable("current_a", "A", "current"),
    Variable("current_rate_a_s", "A/s", "current rate"),
    Variable("temperature_c", "degC", "temperature"),
    Variable("time_s", "s", "time in the run"),
    Variable("energy_j", "J", "energy put in"),
)
BY_NAME = {variable.name: variable for variable in VARIABLES}


@dataclass(frozen=True, slots=True)
class Condition:
    """A range of a variable in which the error is significantly above the average."""

    variable: str
    low: float
    high: float
    unit: str
    rmse_n: float
    bias_n: float
    score: float
    words: str


@dataclass(frozen=True, slots=True)
class Band:
    """The residual's RMS in a band of frequency."""

    low_hz: float
    high_hz: float
    rms_n: float


def signal(run: Run, name: str) -> Array:
    """A variable's values (n) over a run."""
    if name == "current_rate_a_s":
        return current_rate_a_s(run.current_a, run.sample_rate_hz)
    if name == "energy_j":
        return np.asarray(np.cumsum(run.force_n * run.velocity_m_s) * run.dt_s)
    if name == "time_s":
        return np.asarray(run.time_s - run.time_s[0])
    return np.asarray(getattr(run, name), dtype=np.float64)


def edges_of(values: Array, bins: int = BINS) -> Array | None:
    """Edges (bins + 1) of equal bins between the outer half percents; None for a value that stands still."""
    low, high = np.quantile(values, [0.005, 0.995])
    scale = max(float(np.abs(values).max()), 1e-12)
    if high - low < 0.02 * scale:
        return None
    return np.linspace(low, high, bins + 1)


def bin_of(values: Array, edges: Array) -> Ints:
    """The bin of each value (n); what lies outside goes to the outer bins, none is lost."""
    return np.asarray(np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2))


def blocks_of(residuals: list[Array]) -> Ints:
    """The block of each sample of all runs: several correlation times long, MOST_BLOCKS a run at most."""
    out, first = [], 0
    for residual in residuals:
        memory = max(correlation_inflation(residual), correlation_inflation(residual**2))
        length = max(1, int(np.ceil(max(3.0 * memory, residual.size / MOST_BLOCKS))))
        numbers = np.arange(residual.size) // length
        out.append(first + numbers)
        first += int(numbers[-1]) + 1
    return np.concatenate(out)


def worst_conditions(runs: list[Run], residuals: list[Array]) -> list[Condition]:
    """The conditions with an error significantly above the average, worst first; neighbours are joined."""
    pooled = np.concatenate(residuals)
    average = float(np.mean(pooled**2))
    if average <= 0.0:
        return []
    blocks = blocks_of(residuals)
    side = np.sign(np.concatenate([run.force_n for run in runs]))
    found: list[tuple[Condition, NDArray[np.bool_]]] = []
    for variable in VARIABLES:
        values = np.concatenate([signal(run, variable.name) for run in runs])
        edges = edges_of(values)
        if edges is None:
            continue
        where = bin_of(values, edges)
        worse = [_score(pooled[where == k] ** 2 - average, blocks[where == k]) for k in range(BINS)]
        rms = [
            float(np.sqrt(np.mean(pooled[where == k] ** 2))) if (where == k).any() else 0.0
            for k in range(BINS)
        ]
        bad = [
            w >= LEAST_SCORE and r >= LEAST_RATIO * np.sqrt(average) for w, r in zip(worse, rms, strict=True)
        ]
        k = 0
        while k < BINS:
            if not bad[k]:
                k += 1
                continue
            end = k
            while end + 1 < BINS and bad[end + 1]:
                end += 1
            inside = (where >= k) & (where <= end)
            low = float(values.min()) if k == 0 else float(edges[k])
            high = float(values.max()) if end == BINS - 1 else float(edges[end + 1])
            score = max(worse[k : end + 1])
            found.append((_condition(variable, low, high, pooled[inside], side[inside], score), inside))
            k = end + 1
    return _without_nested(sorted(found, key=lambda pair: -pair[0].rmse_n))


def _without_nested(found: list[tuple[Condition, NDArray[np.bool_]]]) -> list[Condition]:
    """Without those within a wider condition that is about as bad: they only say again where it fails."""

    def told_by(
        inner: tuple[Condition, NDArray[np.bool_]], outer: tuple[Condition, NDArray[np.bool_]]
    ) -> bool:
        (a, inside), (b, wide) = inner, outer
        share = np.count_nonzero(inside & wide) / np.count_nonzero(inside)
        wider = np.count_nonzero(wide) > np.count_nonzero(inside)
        alike = a.rmse_n < LEAST_RATIO * b.rmse_n
        return bool(a.variable != b.variable and wider and alike and share >= NESTED_SHARE)

    return [one[0] for one in found if not any(told_by(one, other) for other in found)]


def _score(excess: Array, blocks: Ints) -> float:
    """Standard errors by which the mean of `excess` lies above 0, with blocks as what is independent."""
    if excess.size == 0:
        return 0.0
    _, inverse = np.unique(blocks, return_inverse=True)
    sums = np.bincount(inverse, excess)
    counts = np.bincount(inverse)
    if sums.size < FEWEST_BLOCKS:
        return 0.0
    mean = float(excess.mean())
    error = float(np.sqrt(np.sum((sums - counts * mean) ** 2) * sums.size / (sums.size - 1.0)))
    return float(sums.sum()) / max(error, 1e-300)


def _condition(
    variable: Variable, low: float, high: float, residual: Array, side: Array, score: float
) -> Condition:
    rmse, bias = float(np.sqrt(np.mean(residual**2))), float(residual.mean())
    short = float(np.mean(residual * side))
    place = f"{variable.words} {low:.3g} to {high:.3g} {variable.unit}"
    if variable.name == "velocity_m_s" and (low >= 0.0 or high <= 0.0):
        place += " (rebound)" if low >= 0.0 else " (compression)"
    if abs(short) >= 0.5 * rmse:
        what = f"the model gives {abs(short):.3g} N too {'little' if short > 0.0 else 'much'}"
    elif abs(bias) >= 0.5 * rmse:
        what = f"the measured force lies {abs(bias):.3g} N {'above' if bias > 0.0 else 'below'} the model's"
    else:
        what = f"the model errs both ways, {rmse:.3g} N RMS"
    return Condition(variable.name, low, high, variable.unit, rmse, bias, score, f"at {place} {what}")


def mean_map(
    runs: list[Run], residuals: list[Array], x: str, y: str, bins: int = 10
) -> tuple[Array, Array, Array] | None:
    """(x edges, y edges, mean residual in N (y, x)); NaN: few blocks; None: a signal stands still."""
    xs, ys = (np.concatenate([signal(run, name) for run in runs]) for name in (x, y))
    x_edges, y_edges = edges_of(xs, bins), edges_of(ys, bins)
    if x_edges is None or y_edges is None:
        return None
    cell = bin_of(ys, y_edges) * bins + bin_of(xs, x_edges)
    pooled, blocks = np.concatenate(residuals), blocks_of(residuals)
    count = np.bincount(cell, minlength=bins * bins)
    total = np.bincount(cell, pooled, minlength=bins * bins)
    seen = np.unique(np.stack((cell, blocks)), axis=1)[0]
    enough = np.bincount(seen, minlength=bins * bins) >= 3
    values = np.where(enough, total / np.maximum(count, 1), np.nan)
    return x_edges, y_edges, values.reshape(bins, bins)


def spectrum(residual: Array, rate_hz: float) -> tuple[Array, Array]:
    """(frequency in Hz, density in N^2/Hz) of a residual, by Welch's method."""
    f, density = welch(residual, rate_hz, nperseg=min(residual.size, 4096), detrend=False)
    return np.asarray(f), np.asarray(density)


def bands(runs: list[Run], residuals: list[Array]) -> list[Band]:
    """The residual's RMS by octave from 1 Hz, pooled over the runs by duration."""
    top = max(run.sample_rate_hz for run in runs) / 2.0
    limits = [0.0, *(float(2**k) for k in range(int(np.ceil(np.log2(top))))), top]
    squares, seconds = np.zeros(len(limits) - 1), 0.0
    for run, residual in zip(runs, residuals, strict=True):
        power = np.abs(np.fft.rfft(residual)) ** 2
        power[1 : (residual.size + 1) // 2] *= 2.0
        f = np.fft.rfftfreq(residual.size, run.dt_s)
        duration = residual.size * run.dt_s
        squares += duration * np.histogram(f, limits, weights=power / residual.size**2)[0]
        seconds += duration
    return [
        Band(low, high, float(np.sqrt(square / seconds)))
        for low, high, square in zip(limits, limits[1:], squares, strict=False)
    ]
