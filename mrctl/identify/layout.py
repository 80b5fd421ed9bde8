"""The base model's parameters as one vector: which entry is which table value, and back.

Free are: f at the lowest current and its increments (in units of `force_scale_n`), g at every knot but
zero and the gauge knot (where |g| stands at 1 during the fit, since only the product f g is seen), the
logarithms of h on and off at every temperature but the reference (where h is 1), the two currents
between which h goes from off to on, and the hysteresis filter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """Knots and switches of the base model; `order` is that of the hysteresis filter."""

    current_a: Array
    velocity_m_s: Array
    temperature_c: Array
    reference: int  # temperature knot where h is 1
    gauge: int  # velocity knot where |g| is 1 during the fit
    off_below_a: float
    on_above_a: float
    order: int
    force_scale_n: float
    two_states: bool  # h differs off and on
    free_blend: bool  # the two currents of the off-to-on transition are fitted
    latest_off_a: float  # where off ends at the latest, ...
    earliest_on_a: float  # ... and where on begins at the earliest: a state once lost is found by no step
    off_like: NDArray[np.intp]  # by temperature knot, whose h off its own is like: its own if measured

    def with_order(self, order: int) -> Layout:
        """The same tables with another filter order."""
        return replace(self, order=order)

    @cached_property
    def off_unseen(self) -> NDArray[np.intp]:
        """Temperature knots where the on state alone was measured."""
        return np.flatnonzero(self.off_like != np.arange(self.temperature_c.size))

    @cached_property
    def zero(self) -> int:
        """The velocity knot at 0."""
        return int(np.flatnonzero(self.velocity_m_s == 0.0)[0])

    @property
    def gauge_shape(self) -> float:
        """G at the gauge knot: 1, of the velocity's sign."""
        return float(np.sign(self.velocity_m_s[self.gauge]))

    @cached_property
    def free_g(self) -> NDArray[np.intp]:
        """Velocity knots whose g is a parameter."""
        keep = np.ones(self.velocity_m_s.size, dtype=bool)
        keep[[self.zero, self.gauge]] = False
        return np.flatnonzero(keep)

    @cached_property
    def free_h(self) -> NDArray[np.intp]:
        """Temperature knots whose h is a parameter."""
        return np.array([k for k in range(self.temperature_c.size) if k != self.reference], dtype=np.intp)

    @cached_property
    def parts(self) -> dict[str, slice]:
        """Where each part stands in the vector."""
        sizes = {
            "f": self.current_a.size,
            "g": self.free_g.size,
            "h_on": self.free_h.size,
            "h_off": self.free_h.size if self.two_states else 0,
            "blend": 2 if self.free_blend else 0,
            "filter": 2 * self.order,
        }
        parts, at = {}, 0
        for name, size in sizes.items():
            parts[name] = slice(at, at + size)
            at += size
        return parts

    @property
    def size(self) -> int:
        """How many parameters there are."""
        return int(self.parts["filter"].stop)

    def unpack(self, theta: Array) -> Tables:
        """The tables that a parameter vector stands for."""
        p = self.parts
        g = np.zeros(self.velocity_m_s.size)
        g[self.gauge] = self.gauge_shape
        g[self.free_g] = theta[p["g"]]
        eta = np.zeros(self.temperature_c.size)
        eta[self.free_h] = theta[p["h_on"]]
        h_on = np.exp(eta)
        h_off = h_on
        if self.two_states:
            eta = np.zeros(self.temperature_c.size)
            eta[self.free_h] = theta[p["h_off"]]
            h_off = np.exp(eta)
        low, high = self.off_below_a, self.on_above_a
        if self.free_blend:
            low, high = (float(x) for x in theta[p["blend"]])
        f = self.force_scale_n * np.cumsum(theta[p["f"]])
        return Tables(f, g, h_on, h_off, low, high, theta[p["filter"]])

    def pack(self, t: Tables) -> Array:
        """The parameter vector of tables (g is rescaled to the gauge knot, f with it)."""
        scale = abs(t.g[self.gauge])
        f = t.f * scale / self.force_scale_n
        parts = [np.diff(f, prepend=0.0), t.g[self.free_g] / scale, np.log(t.h_on[self.free_h])]
        if self.two_states:
            parts.append(np.log(t.h_off[self.free_h]))
        if self.free_blend:
            parts.append(np.array([t.off_below_a, t.on_above_a]))
        parts.append(t.filter)
        return np.concatenate(parts)


@dataclass(frozen=True)
class Tables:
    """The base model's values: f in N, g, h on and off, the transition in A, the filter's parameters."""

    f: Array
    g: Array
    h_on: Array
    h_off: Array
    off_below_a: float
    on_above_a: float
    filter: Array
