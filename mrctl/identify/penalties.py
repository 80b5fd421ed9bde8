"""What the tables are held to where the data say little: smoothness and weak priors, weighed by evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.layout import Layout

Array = NDArray[np.float64]

STIFFEST = 1e12
SOFTEST = 1e-8
OFF_SPREAD = 0.1  # how much h without current may differ from that with, where it was not measured
THINNING_1_K, STEEPNESS_1_K = 0.005, 0.01  # of the force: what warmth usually takes, how far fluids differ


@dataclass(frozen=True)
class Penalty:
    """weight/2 |rows theta - target|²; `adapts` when the evidence sets its weight."""

    name: str
    rows: Array  # (m, parameters)
    target: Array  # (m,)
    weight: float
    adapts: bool = True
    gram: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "gram", self.rows.T @ self.rows)

    def excess(self, theta: Array) -> float:
        """|rows theta - target|²."""
        miss = self.rows @ theta - self.target
        return float(miss @ miss)

    def slope(self, theta: Array) -> Array:
        """Gradient of half the excess, weight left out."""
        return np.asarray(self.rows.T @ (self.rows @ theta - self.target), dtype=np.float64)

    def reweighed(self, theta: Array, covariance: Array) -> Penalty:
        """One evidence step (generalised Fellner-Schall, Wood & Fasiolo 2017)."""
        if not self.adapts:
            return self
        used = self.rows.shape[0] - self.weight * float(np.sum(covariance * self.gram))
        excess = max(self.excess(theta), 1e-300)
        weight = float(np.clip(max(used, 1e-3) / excess, 0.05 * self.weight, 20.0 * self.weight))
        return replace(self, weight=float(np.clip(weight, SOFTEST, STIFFEST)))


def base_penalties(layout: Layout, prior_theta: Array) -> list[Penalty]:
    """Smooth g, f and h, off near on, and a weak pull to neutral values for what no data decides."""
    n = layout.size
    parts = layout.parts
    found: list[Penalty] = []
    # g in the knots' own count: where they stand densely it may bend more.
    g_rows = np.zeros((layout.velocity_m_s.size, n))
    g_rows[layout.free_g, np.arange(parts["g"].start, parts["g"].stop)] = 1.0
    fixed = np.zeros(layout.velocity_m_s.size)
    fixed[layout.gauge] = layout.gauge_shape
    if layout.free_g.size >= 3:
        d2 = np.diff(np.eye(layout.velocity_m_s.size), n=2, axis=0)
        found.append(Penalty("g", d2 @ g_rows, -d2 @ fixed, 100.0))
    if layout.current_a.size >= 4:
        rows = np.zeros((layout.current_a.size, n))
        rows[:, parts["f"]] = np.tril(np.ones((layout.current_a.size,) * 2))
        d2 = _second_slopes(layout.current_a)
        found.append(Penalty("f", d2 @ rows, np.zeros(d2.shape[0]), 1.0))
    h_rows = _h_rows(layout)
    if layout.temperature_c.size >= 4:
        d2 = _second_slopes(layout.temperature_c)
        found += [Penalty(name, d2 @ rows, np.zeros(d2.shape[0]), 100.0) for name, rows in h_rows.items()]
    if len(h_rows) == 2:
        apart = h_rows["h_off"] - h_rows["h_on"]
        unseen = layout.off_unseen
        farther = apart[unseen] - apart[layout.off_like[unseen]]
        rows = np.concatenate([apart[layout.free_h], farther / OFF_SPREAD])
        found.append(Penalty("off near on", rows, np.zeros(len(rows)), 1.0, adapts=False))
    spread = np.concatenate(
        [
            np.full(layout.current_a.size, 10.0),
            np.full(layout.free_g.size, 3.0),
            np.full(parts["h_off"].stop - parts["h_on"].start, 0.5),
            np.full(parts["blend"].stop - parts["blend"].start, max(float(np.ptp(layout.current_a)), 0.1)),
            np.full(layout.order, 2.5),
            np.full(layout.order, 1.0),
        ]
    )
    rows = np.diag(1.0 / spread)
    found.append(Penalty("prior", rows, rows @ prior_theta, 1.0, adapts=False))
    return found


def fluid_penalties(layout: Layout) -> list[Penalty]:
    """H thins as fluids do, for a model whose fluid is warmer than was measured.

    Else one that hardly warms and thins by much would be as good as one that warms by much and thins as
    fluids do.
    """
    apart = STEEPNESS_1_K * np.diff(layout.temperature_c)
    usual = np.full(apart.size, -THINNING_1_K / STEEPNESS_1_K)
    return [
        Penalty(f"{name} thins", np.diff(rows, axis=0) / apart[:, None], usual, 1.0, adapts=False)
        for name, rows in _h_rows(layout).items()
    ]


def _h_rows(layout: Layout) -> dict[str, Array]:
    """Which parameters are log h at its knots (knots, parameters): on, and off if these are two."""
    found = {}
    for name in ("h_on", "h_off"):
        part = layout.parts[name]
        if part.stop > part.start:
            found[name] = np.zeros((layout.temperature_c.size, layout.size))
            found[name][layout.free_h, np.arange(part.start, part.stop)] = 1.0
    return found


def _second_slopes(knots: Array) -> Array:
    """Second differences for uneven knots, in units of the mean step."""
    x = (knots - knots[0]) / (np.ptp(knots) / (knots.size - 1))
    rows = np.zeros((knots.size - 2, knots.size))
    for k in range(knots.size - 2):
        left, right = x[k + 1] - x[k], x[k + 2] - x[k + 1]
        width = 0.5 * (left + right)
        rows[k, k : k + 3] = [1 / left, -1 / left - 1 / right, 1 / right]
        rows[k] /= np.sqrt(width)
    return rows


def total_weight(penalties: Sequence[Penalty]) -> Array:
    """The penalties' Hessian (parameters, parameters)."""
    return np.asarray(sum(p.weight * p.gram for p in penalties), dtype=np.float64)


def weighed_as(old: Sequence[Penalty], new: Sequence[Penalty]) -> list[Penalty]:
    """A new model's penalties at the weights that the evidence gave them in an old fit."""
    weights = {p.name: p.weight for p in old}
    return [replace(p, weight=weights.get(p.name, p.weight)) for p in new]
