"""The static part of the damper, f(i) g(v) h(i, T), and its exact inverse (Eq. 5.2, 8.1, 3.3).

`h` is known when off (little current) and when on. `off_below_a` is the largest current of the off state,
`on_above_a` the smallest of the on state; between them h goes over linearly, so that the force stays
continuous and increasing in the current. With both equal it switches, as in the paper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from itertools import pairwise
from typing import NamedTuple

from mrctl.model.tables import interpolate


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
    force_on_n: float  # f at on_above_a


class Reach(IntEnum):
    """Where a wish lies against the forces that the damper can give at this velocity and temperature."""

    BELOW = -1  # less force than without current, or force that would drive
    WITHIN = 0
    ABOVE = 1  # more force than at the largest current


class StaticInverse(NamedTuple):
    """A current, the hypothesis it stands on, and whether the wish was within reach."""

    current_a: float
    on: bool
    reach: Reach


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
        interpolate(on_above_a, current_a, force_n),
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


def invert_backbone(
    force_n: float,
    velocity_m_s: float,
    temperature_c: float,
    t: StaticTables,
    current_max_a: float,
    *,
    was_on: bool,
) -> StaticInverse:
    """The current whose static force is the wish, or comes nearest to it (Eq. 8.1, 3.3).

    Total: no velocity, not even zero, divides by zero. See `invert_shape` for the two states of h.
    """
    return invert_shape(
        force_n,
        interpolate(velocity_m_s, t.velocity_m_s, t.shape),
        interpolate(temperature_c, t.temperature_c, t.h_off),
        interpolate(temperature_c, t.temperature_c, t.h_on),
        t,
        current_max_a,
        interpolate(current_max_a, t.current_a, t.force_n),
        was_on,
    )


def invert_shape(  # noqa: PLR0911  # one return for each region of the wish
    force_n: float,
    g: float,
    h_off: float,
    h_on: float,
    t: StaticTables,
    current_max_a: float,
    f_max_n: float,
    was_on: bool,  # noqa: FBT001  # positional for speed: called for every damper in every tick
) -> StaticInverse:
    """The current where f(i) h(i) g is the wish, or comes nearest to it; g, h and f(current_max) looked up.

    Both states of h are tried and the consistent one is kept; where both or neither are (only with a
    switching h), the state it was in stays.
    """
    if force_n * g <= 0.0:
        reach = Reach.WITHIN if force_n == 0.0 and g == 0.0 else Reach.BELOW
        return StaticInverse(0.0, False, reach)
    w = on_weight(current_max_a, t.off_below_a, t.on_above_a)
    strongest_n = f_max_n * (h_off + w * (h_on - h_off))
    force_n, g = abs(force_n), abs(g)
    if force_n >= strongest_n * g:
        return StaticInverse(current_max_a, True, Reach.ABOVE if force_n > strongest_n * g else Reach.WITHIN)
    q = force_n / g  # bounded by the line above, however small g is
    if q <= h_off * t.force_n[0]:
        if not was_on or t.blend_current_a or q < h_on * t.force_on_n:
            return StaticInverse(0.0, False, Reach.BELOW if q < h_off * t.force_n[0] else Reach.WITHIN)
    elif t.off_below_a > 0.0 or not t.blend_current_a:
        i = interpolate(q / h_off, t.force_n, t.current_a)
        holds = i <= t.off_below_a if t.blend_current_a else i < t.on_above_a
        if holds and not (was_on and q >= h_on * t.force_on_n):
            return StaticInverse(i, False, Reach.WITHIN)
    if q >= h_on * t.force_on_n:
        i = interpolate(q / h_on, t.force_n, t.current_a)
        return StaticInverse(min(i, current_max_a), True, Reach.WITHIN)
    if t.blend_current_a:
        i = _invert_blend(q, h_off, h_on, t)
        return StaticInverse(min(i, current_max_a), i >= t.on_above_a, Reach.WITHIN)
    # The gap of a switching h: no current gives this force, so stay on the side it is on.
    edge = t.on_above_a if was_on else math.nextafter(t.on_above_a, 0.0)
    return StaticInverse(edge, was_on, Reach.WITHIN)


def _invert_blend(q: float, h_off: float, h_on: float, t: StaticTables) -> float:
    """The current between the off and the on state where f(i) h(i, T) = q: a quadratic a segment."""
    span = t.on_above_a - t.off_below_a
    i0, f0, h0 = t.blend_current_a[0], t.blend_force_n[0], h_off
    for i1, f1 in zip(t.blend_current_a[1:], t.blend_force_n[1:], strict=True):
        h1 = h_off + (h_on - h_off) * (i1 - t.off_below_a) / span
        if q <= f1 * h1:
            df, dh = f1 - f0, h1 - h0
            a, b, c = df * dh, f0 * dh + h0 * df, f0 * h0 - q
            if c >= 0.0:
                return i0
            root = -2.0 * c / (b + math.sqrt(max(0.0, b * b - 4.0 * a * c)))
            return i0 + (i1 - i0) * min(1.0, root)
        i0, f0, h0 = i1, f1, h1
    return i0


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
