"""The static part of the damper, f(i) g(v) h(i, T) (Eq. 5.2); static_inverse.py is its inverse.

`h` is known when off (little current) and when on. `off_below_a` is the largest current of the off state,
`on_above_a` the smallest of the on state; between them h goes over linearly, so that the force stays
continuous and increasing in the current. With both equal it switches, as in the paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from mrctl.model.tables import interpolate

SMALLEST = 1e-9  # of g, at the end of its table


class StaticTables(NamedTuple):
    """Tables of the separable model; build with `static_tables`, which adds the two derived ones."""

    current_a: Sequence[float]  # knots of f
    force_n: Sequence[float]  # f: strictly increasing, > 0
    velocity_m_s: Sequence[float]  # knots of g
    shape: Sequence[float]  # g: -1..1, its sign is that of the velocity
    temperature_c: Sequence[float]  # knots of h
    h_off: Sequence[float]  # h without current, > 0
    h_on: Sequence[float]  # h with current, > 0
    off_below_a: float
    on_above_a: float
    blend_current_a: Sequence[float]  # currents where f or the blend of h has a corner
    blend_force_n: Sequence[float]  # f at these


def static_tables(
    current_a: Sequence[float],
    force_n: Sequence[float],
    velocity_m_s: Sequence[float],
    shape: Sequence[float],
    temperature_c: Sequence[float],
    h_off: Sequence[float],
    h_on: Sequence[float],
    off_below_a: float,
    on_above_a: float,
) -> StaticTables:
    """The tables as tuples of floats, with the corners of the off-to-on transition worked out."""
    corners: list[float] = []
    if on_above_a > off_below_a:
        corners = [off_below_a, *(i for i in current_a if off_below_a < i < on_above_a), on_above_a]
    return StaticTables(
        tuple(map(float, current_a)),
        tuple(map(float, force_n)),
        tuple(map(float, velocity_m_s)),
        tuple(map(float, shape)),
        tuple(map(float, temperature_c)),
        tuple(map(float, h_off)),
        tuple(map(float, h_on)),
        float(off_below_a),
        float(on_above_a),
        tuple(map(float, corners)),
        tuple(interpolate(i, current_a, force_n) for i in corners),
    )


def on_weight(current_a: float, off_below_a: float, on_above_a: float) -> float:
    """How far the damper is in its on state at a current: 0 off, 1 on."""
    if current_a >= on_above_a:
        return 1.0
    if current_a <= off_below_a:
        return 0.0
    return (current_a - off_below_a) / (on_above_a - off_below_a)


def force_level(current_a: float, temperature_c: float, t: StaticTables) -> float:
    """The static force in N where g is 1: f(i) h(i, T)."""
    w = on_weight(current_a, t.off_below_a, t.on_above_a)
    h = interpolate(temperature_c, t.temperature_c, t.h_off)
    if w > 0.0:
        h += w * (interpolate(temperature_c, t.temperature_c, t.h_on) - h)
    return interpolate(current_a, t.current_a, t.force_n) * h


def backbone_force(velocity_m_s: float, current_a: float, temperature_c: float, t: StaticTables) -> float:
    """The static force in N, f(i) g(v) h(i, T) (Eq. 5.2)."""
    return force_level(current_a, temperature_c, t) * interpolate(velocity_m_s, t.velocity_m_s, t.shape)


def compression_speed(share: float, t: StaticTables) -> float:
    """The speed in m/s in compression at which g is minus a share (> 0); past its table, in proportion."""
    knots, shape = t.velocity_m_s, t.shape
    k = len(knots) - 1
    while k > 0 and knots[k] > 0.0:
        k -= 1
    while k > 0 and shape[k - 1] > -share:
        k -= 1
    if k == 0:
        return knots[0] * share / min(shape[0], -SMALLEST)
    part = (shape[k] + share) / (shape[k] - shape[k - 1])
    return part * (knots[k] - knots[k - 1]) - knots[k]


def transition_increases(t: StaticTables) -> bool:
    """Whether force increases with current all through the off-to-on transition, at every temperature.

    f h is quadratic on each segment and bilinear in the two h, so the slope at the segment's ends, at
    each temperature knot, decides.
    """
    span = t.on_above_a - t.off_below_a
    for h_off, h_on in zip(t.h_off, t.h_on, strict=True):
        knots = [
            (f, h_off + (h_on - h_off) * (i - t.off_below_a) / span)
            for i, f in zip(t.blend_current_a, t.blend_force_n, strict=True)
        ]
        for (f0, h0), (f1, h1) in pairwise(knots):
            df, dh = f1 - f0, h1 - h0
            if f0 * dh + h0 * df <= 0.0 or f1 * dh + h1 * df <= 0.0:
                return False
    return True


def force_range(
    velocity_m_s: float, temperature_c: float, t: StaticTables, current_max_a: float
) -> tuple[float, float]:
    """The static forces in N with no current and with the largest, at a velocity and temperature."""
    return (
        backbone_force(velocity_m_s, 0.0, temperature_c, t),
        backbone_force(velocity_m_s, current_max_a, temperature_c, t),
    )
