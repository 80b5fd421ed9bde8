"""The base model F = H[f(i) g(v) h(i, T)] over whole records, with its analytic Jacobian."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import hysteresis
from mrctl.identify.knots import Located, locate
from mrctl.identify.layout import Layout, Tables

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Inputs:
    """A record's motion, current and temperature, located among the layout's knots."""

    rate_hz: float
    current_a: Array
    velocity: Located
    current: Located
    temperature: Located

    @classmethod
    def of(
        cls, layout: Layout, rate_hz: float, velocity_m_s: Array, current_a: Array, temperature_c: Array
    ) -> Inputs:
        """Locate n samples of each."""
        return cls(
            rate_hz,
            current_a,
            locate(velocity_m_s, layout.velocity_m_s),
            locate(current_a, layout.current_a),
            locate(temperature_c, layout.temperature_c),
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
    return np.clip((current_a - off_below_a) / width, 0.0, 1.0)


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
    return hysteresis.filtered(b, a, backbone(inputs, t).force_n)


def averaged(x: Array, factor: int) -> Array:
    """Means over `factor` samples along the last axis; a rest that fills no block is left out."""
    if factor == 1:
        return x
    n = (x.shape[-1] // factor) * factor
    return np.asarray(x[..., :n].reshape(*x.shape[:-1], -1, factor).mean(axis=-1), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Rows:
    """Derivatives (m, n // factor) by the parameters `index` (m) of the layout."""

    values: Array
    index: NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class StaticRows:
    """Derivatives of the static force, and of its level f h, by the tables' parameters (n // factor each).

    The level has no derivatives by g; its rows are those of the first `levels` parameters.
    """

    static: Array
    level: Array
    index: NDArray[np.intp]
    shared: int  # increments of f below the first one in use: they act as it does

    def dealt(self, values: Array) -> Rows:
        """Rows made of `static`, with the first one repeated for the increments that share it."""
        if not self.shared:
            return Rows(values, self.index)
        lower = self.index[0] - self.shared + np.arange(self.shared)
        return Rows(
            np.concatenate([np.repeat(values[:1], self.shared, axis=0), values]),
            np.concatenate([lower, self.index]),
        )


def static_rows(
    inputs: Inputs, layout: Layout, t: Tables, factor: int = 1, gain: Array | None = None
) -> StaticRows:
    """How the static force moves with the tables, averaged over `factor` samples.

    `gain`: what effects multiply the static force by, sample by sample.
    """
    parts = layout.parts
    bb = backbone(inputs, t)
    g = bb.g if gain is None else bb.g * gain
    level: list[Array] = []
    rows: list[Array] = []
    where: list[NDArray[np.intp]] = []

    def add(by_level: Callable[[Array], Array], index: NDArray[np.intp]) -> None:
        rows.append(by_level(g))
        level.append(by_level(np.ones_like(g)) if gain is not None else np.zeros((0, 0)))
        where.append(index)

    # f: an increment reaches every knot above it, so hats are summed from the top.
    first_f = int(inputs.current.below.min())

    def by_f(weight: Array) -> Array:
        hats, _ = inputs.current.hats(weight * bb.h * layout.force_scale_n, factor)
        return np.asarray(np.cumsum(hats[::-1], axis=0)[::-1], dtype=np.float64)

    count = int(inputs.current.below.max()) - first_f + (2 if inputs.current.count > 1 else 1)
    add(by_f, np.arange(first_f, first_f + count) + parts["f"].start)
    if layout.free_h.size:
        _add_h(inputs, layout, t, bb, factor, add)
    if layout.free_blend:
        width = max(t.on_above_a - t.off_below_a, 1e-9)
        inside = (inputs.current_a >= t.off_below_a) & (inputs.current_a <= t.on_above_a)
        by_w = np.where(inside, bb.f * (bb.h_on - bb.h_off), 0.0) / width
        add(
            lambda weight: averaged(np.stack([weight * by_w * (bb.w - 1.0), -weight * by_w * bb.w]), factor),
            np.arange(parts["blend"].start, parts["blend"].stop),
        )

    fh = bb.f * bb.h if gain is None else bb.f * bb.h * gain
    hats, first = inputs.velocity.hats(fh, factor)
    position = np.full(inputs.velocity.count, -1)
    position[layout.free_g] = np.arange(layout.free_g.size)
    kept = np.flatnonzero((position[first : first + hats.shape[0]] >= 0) & hats.any(axis=1))
    rows.append(hats[kept])
    where.append(position[first + kept] + parts["g"].start)
    return StaticRows(
        np.concatenate(rows),
        np.concatenate(level) if gain is not None else np.zeros((0, 0)),
        np.concatenate(where),
        first_f,
    )


def _add_h(
    inputs: Inputs,
    layout: Layout,
    t: Tables,
    bb: Backbone,
    factor: int,
    add: Callable[[Callable[[Array], Array], NDArray[np.intp]], None],
) -> None:
    position = np.full(inputs.temperature.count, -1)
    position[layout.free_h] = np.arange(layout.free_h.size)
    states = [("h_on", t.h_on, bb.w if layout.two_states else np.ones_like(bb.w))]
    if layout.two_states:
        states.append(("h_off", t.h_off, 1.0 - bb.w))
    first = int(inputs.temperature.below.min())
    count = int(inputs.temperature.below.max()) - first + (2 if inputs.temperature.count > 1 else 1)
    kept = np.flatnonzero(position[first : first + count] >= 0)
    for name, table, share in states:
        if not np.any(share) or not kept.size:
            continue
        scale = table[first + kept, None]

        def by_h(weight: Array, share: Array = share, scale: Array = scale) -> Array:
            return np.asarray(inputs.temperature.hats(weight * bb.f * share, factor)[0][kept] * scale)

        add(by_h, position[first + kept] + layout.parts[name].start)


def linearise(inputs: Inputs, layout: Layout, t: Tables, factor: int = 1) -> tuple[Array, Rows]:
    """Force (n), and its derivatives as averages over `factor` samples.

    The force is exact at every sample. Averaging the slopes costs nothing where the force itself has
    little above the coarser rate, and saves most of the time.
    """
    u = backbone(inputs, t).force_n
    y = hysteresis.filtered(*hysteresis.discretise(t.filter, inputs.rate_hz), u)
    rows = static_rows(inputs, layout, t, factor)
    rate = inputs.rate_hz / factor
    dealt = rows.dealt(hysteresis.filtered(*hysteresis.discretise(t.filter, rate), rows.static))
    return y, with_filter_rows(dealt, layout, t, rate, averaged(u, factor), averaged(y, factor))


def with_filter_rows(rows: Rows, layout: Layout, t: Tables, rate_hz: float, u: Array, y: Array) -> Rows:
    """The rows, with those of the filter that makes y of u."""
    if not layout.order:
        return rows
    part = layout.parts["filter"]
    return Rows(
        np.concatenate([rows.values, hysteresis.sensitivities(t.filter, rate_hz, u, y)]),
        np.concatenate([rows.index, np.arange(part.start, part.stop)]),
    )
