"""Where the fit begins: knots from the data, g from normalised bins, f by least squares, H a plain lag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from mrctl.identify import base, knots
from mrctl.identify.joint import JointModel
from mrctl.identify.layout import Layout, Tables
from mrctl.identify.neutral import neutral
from mrctl.identify.records import Record

Array = NDArray[np.float64]

OFF_CURRENT_A = 0.1  # the paper's "off": the coil is not driven
WARM_STEP_K = 15.0  # between the knots of h where the fluid may be warmer than the case
LEAST_OFF = 0.05  # of the currents' span, in which a damper may still be off
LEAST_SPAN_C = 3.0  # temperatures that differ by less say nothing about h


def layout_for(
    records: Sequence[Record],
    order: int = 3,
    velocity_knots: int = knots.VELOCITY_KNOTS,
    *,
    warmer_k: float = 0.0,
) -> Layout:
    """Knots and switches that this data can carry; h reaches `warmer_k` above the case's temperatures."""
    currents = knots.level_knots([r.current_a for r in records], knots.LEVEL_A, knots.CURRENT_KNOTS)
    temperature = _temperature_knots(records)
    if warmer_k >= LEAST_SPAN_C:
        # Apart: between two cases of nearly one temperature a steep h would stand in for the fluid's rise.
        reached, least_k = temperature[-1] + warmer_k, 0.5 * WARM_STEP_K
        cases = knots.apart(temperature, least_k) if np.ptp(temperature) >= least_k else temperature[:1]
        temperature = knots.filled(np.append(cases, reached), WARM_STEP_K)
    velocity = knots.velocity_knots(records, velocity_knots)
    speed = np.concatenate([np.abs(r.velocity_m_s[:: max(1, len(r) // 4000)]) for r in records])
    gauge = int(np.argmin(np.abs(velocity - np.quantile(speed, 0.9))))
    zero = int(np.flatnonzero(velocity == 0.0)[0])
    gauge = gauge if gauge != zero else velocity.size - 1
    force_scale = float(np.max([np.quantile(np.abs(r.force_n), 0.98) for r in records])) or 1.0
    switch = _transition(currents)
    off = switch.off_a
    two = temperature.size > 1 and off < float(currents.knots[-1]) and _has_off(records, off)
    return Layout(
        current_a=currents.knots,
        velocity_m_s=velocity,
        temperature_c=temperature,
        reference=0,
        gauge=gauge,
        off_below_a=off,
        on_above_a=switch.on_a,
        order=order,
        force_scale_n=force_scale,
        two_states=two,
        free_blend=two and switch.free,
        latest_off_a=switch.latest_off_a,
        earliest_on_a=switch.earliest_on_a,
        off_like=_off_like(records, temperature, off),
    )


def as_warm_as_measured(layout: Layout, records: Sequence[Record]) -> Layout:
    """The layout with h at the case's temperatures alone, where it reaches above these."""
    measured = _temperature_knots(records)
    if layout.temperature_c[-1] < measured[-1] + LEAST_SPAN_C:
        return layout
    two = layout.two_states and measured.size > 1
    like = _off_like(records, measured, layout.off_below_a)
    free = two and layout.free_blend
    return replace(layout, temperature_c=measured, two_states=two, free_blend=free, off_like=like)


def _temperature_knots(records: Sequence[Record]) -> Array:
    samples = [r.temperature_c for r in records]
    low, high = min(float(s.min()) for s in samples), max(float(s.max()) for s in samples)
    if high - low < LEAST_SPAN_C:
        return np.array([float(np.mean([s.mean() for s in samples]))])
    levels = knots.held_levels(samples, knots.LEVEL_C)
    if levels is not None and levels.size <= knots.TEMPERATURE_KNOTS:
        return levels
    count = int(np.clip((high - low) / 5.0, 2, knots.TEMPERATURE_KNOTS))
    return np.linspace(low, high, count)


class _Transition(NamedTuple):
    """The largest off and the smallest on current, whether the data can move them, and how far."""

    off_a: float
    on_a: float
    free: bool
    latest_off_a: float
    earliest_on_a: float


def _transition(currents: knots.Levels) -> _Transition:
    """Where it begins. None of the two states may lose all its currents on the way."""
    i = currents.knots
    low, high = float(i[0]), float(i[-1])
    if i.size == 1:
        edge = max(OFF_CURRENT_A, low) if low <= OFF_CURRENT_A else 0.0
        return _Transition(edge, edge, free=False, latest_off_a=high, earliest_on_a=low)
    if currents.held:
        # Nothing is seen between the lowest level and the next.
        first, more = float(i[1]), i.size > 2
        on = first + (0.5 * float(i[2] - i[1]) if more else 0.0)
        return _Transition(low, on, more, latest_off_a=first, earliest_on_a=0.5 * (low + first))
    span = high - low
    off, on, earliest = (low + share * span for share in (0.02, 0.3, LEAST_OFF))
    return _Transition(off, on, free=True, latest_off_a=high, earliest_on_a=earliest)


def _has_off(records: Sequence[Record], off: float) -> bool:
    return any(bool(np.any(r.current_a <= off + knots.LEVEL_A)) for r in records)


def _off_like(records: Sequence[Record], temperature_c: Array, off: float) -> NDArray[np.intp]:
    """For each temperature knot the nearest with a run in the off state, where only the on state has one.

    Else the knot itself. Within half a knot a run is at it.
    """
    like = np.arange(temperature_c.size)
    if temperature_c.size < 2:
        return like
    least_c = 0.5 * float(np.min(np.diff(temperature_c)))
    is_off = [r.current_a <= off + knots.LEVEL_A for r in records]

    def near(state: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
        at = np.concatenate([r.temperature_c[own] for r, own in zip(records, state, strict=True)])
        away = [float(np.min(np.abs(at - knot), initial=np.inf)) for knot in temperature_c]
        return np.array(away) <= least_c

    seen = near(is_off)
    if seen.any():
        apart = np.abs(temperature_c[:, None] - temperature_c[seen])
        nearest = np.flatnonzero(seen)[np.argmin(apart, axis=1)]
        like = np.where(near([~own for own in is_off]) & ~seen, nearest, like)
    return like


def start_values(model: JointModel) -> Array:
    """First tables for the model's layout: an honest guess, not yet a fit."""
    layout = model.layout
    theta = neutral(layout)
    t = layout.unpack(theta)
    g = _binned_shape(layout, model.records)
    t = Tables(t.f, g, t.h_on, t.h_off, t.off_below_a, t.on_above_a, t.filter)
    return layout.pack(
        Tables(_increasing_f(model, t), g, t.h_on, t.h_off, t.off_below_a, t.on_above_a, t.filter)
    )


def _binned_shape(layout: Layout, records: Sequence[Record]) -> Array:
    """G at its knots: normalised force averaged around each, odd outside the data, with the right sign."""
    size = layout.velocity_m_s.size
    top, bottom = np.zeros(size), np.zeros(size)
    for r in records:
        peak = float(np.quantile(np.abs(r.force_n), 0.95))
        if peak <= 0.0:
            continue
        where = knots.locate(r.velocity_m_s, layout.velocity_m_s)
        for at, share in ((where.below, 1.0 - where.share), (where.below + 1, where.share)):
            top += np.bincount(at, share * r.force_n / peak, size)[:size]
            bottom += np.bincount(at, share, size)[:size]
    g = np.where(bottom > 0.0, top / np.maximum(bottom, 1e-12), np.nan)
    sides = np.abs(np.stack([g, g[::-1]]))
    seen = np.isfinite(sides).any(axis=0)
    odd = np.zeros(size)
    odd[seen] = np.nanmean(sides[:, seen], axis=0)
    odd = np.interp(np.arange(size), np.flatnonzero(seen), odd[seen])
    odd = np.maximum(odd, 0.02)
    odd[layout.zero] = 0.0
    side = np.maximum.accumulate(odd[layout.zero :])
    side = side / side[abs(layout.gauge - layout.zero)]
    return np.concatenate([-side[:0:-1], side])


def _increasing_f(model: JointModel, t: Tables) -> Array:
    """F at its knots: non-negative least squares on its increments, filter and h neutral."""
    layout = model.layout
    part = layout.parts["f"]
    count = layout.current_a.size
    matrix, right = np.zeros((count, count)), np.zeros(count)
    for record, inputs in zip(model.records, model.inputs, strict=True):
        factor = model.factor(record)
        _, line = base.linearise(inputs, layout, t, factor)
        keep = line.index < part.stop
        rows, at = line.values[keep], line.index[keep]
        matrix[np.ix_(at, at)] += rows @ rows.T / rows.shape[1]
        right[at] += rows @ base.averaged(record.force_n, factor) / rows.shape[1]
    ridge = 1e-4 * np.trace(matrix) / count
    lower = np.linalg.cholesky(matrix + ridge * np.eye(count))
    steps, _ = nnls(lower.T, np.linalg.solve(lower, right))
    return np.asarray(layout.force_scale_n * np.cumsum(np.maximum(steps, 1e-3)), dtype=np.float64)
