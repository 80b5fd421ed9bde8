"""The base model F = H[f(i) g(v) h(i, T)] over whole records, with its analytic Jacobian."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import filtering, hysteresis
from mrctl.identify.knots import Located, locate
from mrctl.identify.layout import Layout, Tables
from mrctl.simulate.run import whole

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SLOPES_HZ = 1000.0  # slopes that go through a filter at less belong to another filter


@dataclass(frozen=True, slots=True)
class Inputs:
    """Motion, current and temperature of a record, or of several end to end, among the layout's knots."""

    rate_hz: float
    current_a: Array
    velocity: Located
    current: Located
    temperature: Located
    starts: Ints  # where each record begins, and where the last one ends

    @classmethod
    def of(
        cls,
        layout: Layout,
        rate_hz: float,
        velocity_m_s: Array,
        current_a: Array,
        temperature_c: Array,
        starts: Ints | None = None,
    ) -> Inputs:
        """Locate n samples of each; `starts`: of the records, when there are several."""
        return cls(
            rate_hz,
            current_a,
            locate(velocity_m_s, layout.velocity_m_s),
            locate(current_a, layout.current_a),
            locate(temperature_c, layout.temperature_c),
            whole(current_a.size) if starts is None else starts,
        )


@dataclass(frozen=True, slots=True)
class Backbone:
    """The static force and its factors at each sample (n each)."""

    f: Array
    g: Array
    h: Array
    w: Array  # how far on
    h_on: Array
    h_off: Array

    @property
    def force_n(self) -> Array:
        """F g h."""
        return self.f * self.g * self.h


def on_weights(current_a: Array, off_below_a: float, on_above_a: float) -> Array:
    """`mrctl.model.static.on_weight`, sample by sample."""
    width = max(on_above_a - off_below_a, 1e-9)
    # Where the two have crossed, what is above the lower one is on.
    return np.where(current_a >= on_above_a, 1.0, np.clip((current_a - off_below_a) / width, 0.0, 1.0))


def backbone(inputs: Inputs, t: Tables) -> Backbone:
    """The static force's factors."""
    w = on_weights(inputs.current_a, t.off_below_a, t.on_above_a)
    h_on = inputs.temperature.values(t.h_on)
    h_off = h_on if t.h_off is t.h_on else inputs.temperature.values(t.h_off)
    return Backbone(
        inputs.current.values(t.f), inputs.velocity.values(t.g), h_off + w * (h_on - h_off), w, h_on, h_off
    )


def force(inputs: Inputs, t: Tables) -> Array:
    """The model's force in N at each sample, the filter settled on the first."""
    b, a = hysteresis.discretise(t.filter, inputs.rate_hz)
    return filtering.filtered(b, a, backbone(inputs, t).force_n, inputs.starts)


def in_blocks(x: Array, factor: int, *, picked: bool) -> Array:
    """Of samples (..., n) what is weighed: n // factor means, or if `picked` the first of each block."""
    return x[..., : (x.shape[-1] // factor) * factor : factor] if picked else averaged(x, factor)


def averaged(x: Array, factor: int, out: Array | None = None) -> Array:
    """Means over `factor` samples along the last axis; a rest that fills no block is left out.

    out: where they go, if not to an array of their own.
    """
    if factor == 1:
        if out is None:
            return x
        out[:] = x
        return out
    n = (x.shape[-1] // factor) * factor
    # A mean over a short last axis is ten times slower.
    out = np.add(x[..., 0:n:factor], x[..., 1:n:factor], out=out)
    for k in range(2, factor):
        out += x[..., k:n:factor]
    out *= 1.0 / factor
    return np.asarray(out, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Rows:
    """Derivatives (m, n // factor) by the parameters `index` (m) of the layout."""

    values: Array
    index: NDArray[np.intp]

    def add_to(self, matrix: Array, right: Array, miss: Array, weight: float) -> None:
        """Add their normal equations to a matrix (p, p) and a right side (p), in place.

        miss: measured less modelled force in N, as many samples as the derivatives have.
        """
        matrix[np.ix_(self.index, self.index)] += weight * (self.values @ self.values.T)
        right[self.index] += weight * (self.values @ miss)


@dataclass(frozen=True, slots=True)
class SlopeRows:
    """Derivatives of the force, on their way through the stages, at the rate of slopes.

    The rows of `values` that differ: those by f, h and their transition, g's, and the filter's.
    """

    values: Array  # (rows, n // inner)
    index: NDArray[np.intp]  # of the layout, `shared` more than there are rows
    shared: int  # increments of f below the first one in use: they act as it does
    static: Array  # the part of `values` that goes through the filter

    def add_filter(self, t: Tables, rate_hz: float, u: Array, y: Array, starts: Ints) -> None:
        """The filter's own slopes, which makes y of u: n each, as they were simulated.

        At a coarser rate the filter is another one: slopes taken there lead a fit to where its error does
        not fall.
        """
        rows = filtering.sensitivities(t.filter, rate_hz, u, y, starts)
        self.values[self.static.shape[0] :] = averaged(rows, u.size // self.values.shape[1])

    def of(self, values: Array) -> SlopeRows:
        """The same parameters' slopes, further on their way or at another rate."""
        return replace(self, values=values, static=values[: self.static.shape[0]])

    def in_blocks(self, by: int, room: int = 0, *, picked: bool) -> Rows:
        """All rows, of each `by` samples what is weighed, in a matrix with room for more rows."""
        out = np.empty((self.index.size + room, self.values.shape[1] // by))
        own = out[self.shared : self.index.size]
        if picked:
            own[:] = in_blocks(self.values, by, picked=True)
        else:
            averaged(self.values, by, own)
        out[: self.shared] = out[self.shared]
        return Rows(out, self.index)


def inner_factor(rate_hz: float, factor: int) -> int:
    """Of the samples that are averaged, how many may be before slopes go through stages and filter."""
    fits = (k for k in range(1, factor + 1) if factor % k == 0 and rate_hz / k > 0.99 * SLOPES_HZ)
    return max(fits, default=1)


def slope_rows(
    inputs: Inputs, layout: Layout, t: Tables, factor: int = 1, gain: Array | None = None
) -> SlopeRows:
    """How the static force moves with the tables, averaged over `factor` samples, before the filter.

    gain: what effects multiply the static force by, sample by sample.
    """
    parts = layout.parts
    bb = backbone(inputs, t)
    level, index = level_rows(inputs, layout, t, bb.g if gain is None else bb.g * gain, factor)
    position = np.full(inputs.velocity.count, -1)
    position[layout.free_g] = np.arange(layout.free_g.size)
    first, used = inputs.velocity.span
    kept = np.flatnonzero(position[first : first + used] >= 0)
    shared = int(inputs.current.below.min())
    count = index.size + kept.size
    filters = np.arange(parts["filter"].start, parts["filter"].stop)
    values = np.empty((count + filters.size, level.shape[1]))
    values[: index.size] = level
    fh = bb.f * bb.h if gain is None else bb.f * bb.h * gain
    inputs.velocity.fill_hats(fh, factor, values[index.size : count], kept)
    lower = index[0] - shared + np.arange(shared)
    return SlopeRows(
        values,
        np.concatenate([lower, index, position[first + kept] + parts["g"].start, filters]),
        shared,
        values[:count],
    )


def level_rows(
    inputs: Inputs, layout: Layout, t: Tables, weight: Array, factor: int = 1
) -> tuple[Array, NDArray[np.intp]]:
    """How f h moves with f, h and their transition, times a weight (n): rows (m, n // factor), parameters."""
    parts = layout.parts
    bb = backbone(inputs, t)
    first_f, _ = inputs.current.span
    hats = inputs.current.hats(weight * bb.h * layout.force_scale_n, factor)
    for k in reversed(range(len(hats) - 1)):  # f: an increment reaches every knot above it
        hats[k] += hats[k + 1]
    rows = [hats]
    where = [np.arange(first_f, first_f + hats.shape[0]) + parts["f"].start]
    if layout.free_h.size:
        for values, index in _h_rows(inputs, layout, t, bb, weight, factor):
            rows.append(values)
            where.append(index)
    if layout.free_blend:
        width = max(t.on_above_a - t.off_below_a, 1e-9)
        inside = (inputs.current_a >= t.off_below_a) & (inputs.current_a <= t.on_above_a)
        by_w = weight * np.where(inside, bb.f * (bb.h_on - bb.h_off), 0.0) / width
        rows.append(averaged(np.stack([by_w * (bb.w - 1.0), -by_w * bb.w]), factor))
        where.append(np.arange(parts["blend"].start, parts["blend"].stop))
    return np.concatenate(rows), np.concatenate(where)


def _h_rows(
    inputs: Inputs, layout: Layout, t: Tables, bb: Backbone, weight: Array, factor: int
) -> Iterator[tuple[Array, NDArray[np.intp]]]:
    position = np.full(inputs.temperature.count, -1)
    position[layout.free_h] = np.arange(layout.free_h.size)
    states = [("h_on", t.h_on, bb.w if layout.two_states else np.ones_like(bb.w))]
    if layout.two_states:
        states.append(("h_off", t.h_off, 1.0 - bb.w))
    first, used = inputs.temperature.span
    kept = np.flatnonzero(position[first : first + used] >= 0)
    for name, table, share in states:
        if np.any(share) and kept.size:
            hats = inputs.temperature.hats(weight * bb.f * share, factor)[kept]
            yield hats * table[first + kept, None], position[first + kept] + layout.parts[name].start


def linearise(
    inputs: Inputs, layout: Layout, t: Tables, factor: int = 1, *, picked: bool = False
) -> tuple[Array, Rows]:
    """Force (n), and its derivatives as averages over `factor` samples, or `picked` (`in_blocks`).

    The force is exact at every sample. Averaging slopes costs nothing where the force itself has little
    above the coarser rate, and saves most of the time.
    """
    u = backbone(inputs, t).force_n
    y = filtering.filtered(*hysteresis.discretise(t.filter, inputs.rate_hz), u, inputs.starts)
    inner = 1 if picked else inner_factor(inputs.rate_hz, factor)
    rows = slope_rows(inputs, layout, t, inner)
    coarse = hysteresis.discretise(t.filter, inputs.rate_hz / inner)
    filtering.filter_rows(*coarse, rows.static, inputs.starts // inner)
    rows.add_filter(t, inputs.rate_hz, u, y, inputs.starts)
    return y, rows.in_blocks(factor // inner, picked=picked)
