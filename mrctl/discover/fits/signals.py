"""The signals that a residual, or an effect's size, is held against."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.records import Record

Array = NDArray[np.float64]

UNITS = {
    "velocity": "m/s", "stroke": "m", "acceleration": "m/s^2", "current": "A", "current rate": "A/s",
    "temperature": "degC", "time": "s", "energy": "J", "force": "N", "force rate": "N/s", "turned": "m",
}  # fmt: skip

RATE_OVER_S = 0.01  # so that the sample rate does not set the size of a step


def turned_m(record: Record) -> Array:
    """The way in m that each sample (n) is from where the motion last turned, with the velocity's sign."""
    v = record.velocity_m_s
    sign = np.sign(v)
    turns = np.flatnonzero(np.diff(sign) != 0) + 1
    way = np.cumsum(np.abs(v)) / record.rate_hz
    start = np.zeros(v.size)
    start[turns] = np.diff(way[np.concatenate([[0], turns])], prepend=0.0)[1:] if turns.size else 0.0
    return np.asarray((way - np.cumsum(start)) * sign)


def current_rate_a_s(current_a: Array, rate_hz: float) -> Array:
    """The rate of a current (n) over the last moments: a step has no rate of its own."""
    span = max(1, round(RATE_OVER_S * rate_hz))
    before = np.concatenate([np.full(span, current_a[0]), current_a])[: current_a.size]
    return np.asarray((current_a - before) * (rate_hz / span), dtype=np.float64)


def signals_of(record: Record, force: Array) -> dict[str, Array]:
    """Each of a record's samples (n) by signal, in `UNITS`; force: the model's (n), in N."""
    dt = 1.0 / record.rate_hz
    v = record.velocity_m_s
    return {
        "velocity": v,
        "stroke": record.displacement_m,
        "acceleration": record.acceleration_m_s2,
        "current": record.current_a,
        "current rate": current_rate_a_s(record.current_a, record.rate_hz),
        "temperature": record.temperature_c,
        "time": np.arange(v.size, dtype=np.float64) * dt,
        "energy": np.cumsum(force * v) * dt,
        "force": force,
        "force rate": np.gradient(force) / dt,
        "turned": turned_m(record),
    }
