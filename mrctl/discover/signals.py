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


def turned_m(record: Record) -> Array:
    """The way in m that each sample (n) is from where the motion last turned, with the velocity's sign."""
    v = record.velocity_m_s
    sign = np.sign(v)
    turns = np.flatnonzero(np.diff(sign) != 0) + 1
    way = np.cumsum(np.abs(v)) / record.rate_hz
    start = np.zeros(v.size)
    start[turns] = np.diff(way[np.concatenate([[0], turns])], prepend=0.0)[1:] if turns.size else 0.0
    return np.asarray((way - np.cumsum(start)) * sign)


def signals_of(record: Record, force: Array) -> dict[str, Array]:
    """Each of a record's samples (n) by signal, in `UNITS`; force: the model's (n), in N."""
    dt = 1.0 / record.rate_hz
    v = record.velocity_m_s
    span = max(1, round(0.01 * record.rate_hz))
    before = np.concatenate([np.full(span, record.current_a[0]), record.current_a])[: v.size]
    return {
        "velocity": v,
        "stroke": record.displacement_m,
        "acceleration": record.acceleration_m_s2,
        "current": record.current_a,
        "current rate": (record.current_a - before) / (span * dt),
        "temperature": record.temperature_c,
        "time": np.arange(v.size) * dt,
        "energy": np.cumsum(force * v) * dt,
        "force": force,
        "force rate": np.gradient(force) / dt,
        "turned": turned_m(record),
    }
