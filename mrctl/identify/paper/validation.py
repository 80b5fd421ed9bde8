"""Ch. 7 and Sec. 9.2: the whole model against every run, forwards, and through the inverse and back.

Over the kept samples of each run, against its filtered force (Sec. 5.1), from the state that the model has
after the samples before. Percent: of the run's largest absolute force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from mrctl.identify.paper.fir import AdaptiveFilters
from mrctl.identify.paper.prepare import Preparation, Record
from mrctl.model.filters import Filter, settled_state
from mrctl.model.static import StaticTables, force_level
from mrctl.model.static_inverse import StaticInverter

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ForwardErrors:
    """Figs. 7.2 and 7.3, each (runs): RMSE in N with the IIR filter, the low-pass, and each run's own FIR."""

    peak_n: Array
    iir_n: Array
    lowpass_n: Array
    fir_n: Array

    def percent(self, rmse_n: Array) -> Array:
        """Of each run's largest absolute force."""
        return 100.0 * rmse_n / self.peak_n


@dataclass(frozen=True, slots=True, eq=False)
class Retraced:
    """One run through inverse and forward model (n kept samples each): Figs. 9.2 to 9.4 and 9.6."""

    force_n: Array  # wanted: the measured one
    returned_n: Array
    current_a: Array


@dataclass(frozen=True, slots=True, eq=False)
class InverseErrors:
    """Figs. 9.5 and 9.7, each (runs); `runs` keeps the signals."""

    rmse_n: Array
    rmse_percent: Array
    mean_current_a: Array
    largest_percent: Array
    runs: tuple[Retraced, ...]


def filtered(filter_: Filter, u: Array) -> Array:
    """The signal u (n) through the filter, from the state that its first value, held for ever, leads to."""
    state = settled_state(filter_.coefficients, float(u[0]))
    return np.asarray(lfilter(filter_.b, filter_.a, u, zi=state)[0], dtype=np.float64)


def backbone_over_time(record: Record, tables: StaticTables) -> Array:
    """f(i) g(v) h(i, T) at each sample of a record."""
    shape = np.interp(record.velocity_m_s, tables.velocity_m_s, tables.shape)
    return np.asarray(force_level(record.current_a, record.temperature_c, tables) * shape, dtype=np.float64)


def forward_errors(
    preparation: Preparation, tables: StaticTables, iir: Filter, lowpass: Filter, filters: AdaptiveFilters
) -> ForwardErrors:
    """The forward model with each of the three kinds of filter."""
    rows = []
    for record, own in zip(preparation.records, filters.runs, strict=True):
        back, force = backbone_over_time(record, tables), record.cut(record.force_n)
        past = np.full(filters.taps - 1, back[0])
        by_fir = np.convolve(np.concatenate([past, back]), own.lms, "valid")
        models = (filtered(iir, back), filtered(lowpass, back), by_fir)
        rows.append([np.max(np.abs(force)), *(_rmse(record.cut(model) - force) for model in models)])
    return ForwardErrors(*(np.array(column) for column in zip(*rows, strict=True)))


def inverse_errors(
    preparation: Preparation, tables: StaticTables, forward: Filter, inverse: Filter, current_max_a: float
) -> InverseErrors:
    """Each run's force into the inverse model (Eq. 8.1), its current into the forward model."""
    runs = tuple(retrace(r, tables, forward, inverse, current_max_a) for r in preparation.records)
    rmse = np.array([_rmse(run.returned_n - run.force_n) for run in runs])
    peak = np.array([np.max(np.abs(run.force_n)) for run in runs])
    worst = np.array([np.max(np.abs(run.returned_n - run.force_n)) for run in runs])
    mean = np.array([np.mean(run.current_a) for run in runs])
    return InverseErrors(rmse, 100.0 * rmse / peak, mean, 100.0 * worst / peak, runs)


def retrace(
    record: Record, tables: StaticTables, forward: Filter, inverse: Filter, current_max_a: float
) -> Retraced:
    """Eq. 8.1 as it stands, without any care at g = 0, then the forward model."""
    inverter = StaticInverter(tables, current_max_a, record.temperature_c)
    shape = np.interp(record.velocity_m_s, tables.velocity_m_s, tables.shape)
    current = np.empty(shape.size)
    on = record.current_a >= tables.on_above_a
    for k, (wish, g) in enumerate(
        zip(filtered(inverse, record.force_n).tolist(), shape.tolist(), strict=True)
    ):
        current[k], on, _ = inverter.invert(wish, g, on)
    level = _levels(current, record.temperature_c, tables)
    returned = filtered(forward, level * shape)
    return Retraced(*(record.cut(x) for x in (record.force_n, returned, current)))


def _levels(current_a: Array, temperature_c: float, t: StaticTables) -> Array:
    """f(i) h(i, T) at each current."""
    h_off = np.interp(temperature_c, t.temperature_c, t.h_off)
    h_on = np.interp(temperature_c, t.temperature_c, t.h_on)
    span = t.on_above_a - t.off_below_a
    on = np.clip((current_a - t.off_below_a) / span, 0.0, 1.0) if span > 0.0 else current_a >= t.on_above_a
    return np.asarray(
        np.interp(current_a, t.current_a, t.force_n) * (h_off + on * (h_on - h_off)), dtype=np.float64
    )


def _rmse(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))
