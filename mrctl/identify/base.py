"""The base model F = H[f(i) g(v) h(i, T)] over whole records, with its analytic Jacobian."""

from __future__ import annotations

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
class Linearised:
    """A record's force (n), and derivatives (m, n // factor) by the parameters `index` (m) that it sees."""

    force_n: Array
    jacobian: Array
    index: NDArray[np.intp]


def linearise(
    inputs: Inputs, layout: Layout, t: Tables, factor: int = 1, gain: Array | None = None
) -> Linearised:
    """Force and its derivatives; the derivatives as averages over `factor` samples.

    The force is exact at every sample. Averaging the slopes costs nothing where the force itself has
    little above the coarser rate, and saves most of the time.
    `gain`: what an effect multiplies the static force by, sample by sample.
    """
    parts = layout.parts
    bb = backbone(inputs, t)
    one = 1.0 if gain is None else gain
    rows: list[Array] = []
    where: list[NDArray[np.intp]] = []

    # f: an increment reaches every knot above it, so hats are summed from the top.
    hats, first_f = inputs.current.hats(bb.g * bb.h * one * layout.force_scale_n, factor)
    # Increments up to the lowest knot in use all act alike: one row serves them.
    rows.append(np.cumsum(hats[::-1], axis=0)[::-1])
    where.append(np.arange(first_f, first_f + hats.shape[0]) + parts["f"].start)

    hats, first = inputs.velocity.hats(bb.f * bb.h * one, factor)
    position = np.full(inputs.velocity.count, -1)
    position[layout.free_g] = np.arange(layout.free_g.size)
    kept = np.flatnonzero((position[first : first + hats.shape[0]] >= 0) & hats.any(axis=1))
    rows.append(hats[kept])
    where.append(position[first + kept] + parts["g"].start)

    fg = bb.f * bb.g * one
    if layout.free_h.size:
        position = np.full(inputs.temperature.count, -1)
        position[layout.free_h] = np.arange(layout.free_h.size)
        states = [("h_on", t.h_on, bb.w if layout.two_states else np.ones_like(bb.w))]
        if layout.two_states:
            states.append(("h_off", t.h_off, 1.0 - bb.w))
        for name, table, weight in states:
            if not np.any(weight):
                continue
            hats, first = inputs.temperature.hats(fg * weight, factor)
            hats *= table[first : first + hats.shape[0], None]
            kept = np.flatnonzero((position[first : first + hats.shape[0]] >= 0) & hats.any(axis=1))
            rows.append(hats[kept])
            where.append(position[first + kept] + parts[name].start)

    if layout.free_blend:
        width = max(t.on_above_a - t.off_below_a, 1e-9)
        inside = (inputs.current_a >= t.off_below_a) & (inputs.current_a <= t.on_above_a)
        by_w = np.where(inside, fg * (bb.h_on - bb.h_off), 0.0) / width
        rows.append(averaged(np.stack([by_w * (bb.w - 1.0), -by_w * bb.w]), factor))
        where.append(np.arange(parts["blend"].start, parts["blend"].stop))

    u = bb.force_n * one
    y = hysteresis.filtered(*hysteresis.discretise(t.filter, inputs.rate_hz), u)
    rate = inputs.rate_hz / factor
    jacobian = hysteresis.filtered(*hysteresis.discretise(t.filter, rate), np.concatenate(rows))
    index = np.concatenate(where)
    if first_f > 0:
        # The shared row of the lower increments is dealt out again.
        jacobian = np.concatenate([np.repeat(jacobian[:1], first_f, axis=0), jacobian])
        index = np.concatenate([np.arange(first_f) + parts["f"].start, index])
    if layout.order:
        by_filter = hysteresis.sensitivities(t.filter, rate, averaged(u, factor), averaged(y, factor))
        jacobian = np.concatenate([jacobian, by_filter])
        index = np.concatenate([index, np.arange(parts["filter"].start, parts["filter"].stop)])
    return Linearised(y, jacobian, index)
