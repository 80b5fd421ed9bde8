"""Chains of particles that stretch before they yield: the way they go in a sample, by speed or by way.

For the vehicle and the desk alike.
"""

from __future__ import annotations

import math

# Below this part of the shape the speed over it is as it was: near rest both are next to nothing.
SMALLEST_SHAPE = 1e-3
# The plastic part turns round over no less than this: with no length at all it would jump at every reversal.
SHORTEST_M = 1e-5
# What flows along a tanh is full at infinite speed: taken to this part of it.
FULL = 0.999


def speed_per_shape(before_m_s: float, shape: float, velocity_m_s: float) -> float:
    """The speed in m/s over the static shape there; where both are next to nothing, as it was before."""
    size = abs(shape)
    return abs(velocity_m_s) / size if size >= SMALLEST_SHAPE else before_m_s


def pace_of(creep: float, per_shape_m_s: float, shape: float, velocity_m_s: float) -> float:
    """The speed in m/s at which the elastic shape nears the static one: |v| / |shape|^creep."""
    size, speed = abs(shape), abs(velocity_m_s)
    if size >= SMALLEST_SHAPE:
        return float(speed / size**creep)
    return float(speed ** (1.0 - creep) * per_shape_m_s**creep)


def stretched(
    knee: float, before: float, shape_before: float, shape: float, way_before: float, way: float
) -> float:
    """The elastic shape after a sample, over which what the static one makes flow runs straight.

    way_before, way: the sample's displacement in lengths, at the pace of its beginning and of its end. Behind
    a knee what flows at z runs away as z nears the most; it is taken along its tangent.
    """
    full = math.sqrt(knee)
    most = FULL / full if full > 0.0 else math.inf
    z = min(max(before, -most), most)
    flow = _flowing(full, min(max(shape_before, -most), most))
    flow_there = _flowing(full, min(max(shape, -most), most))
    more = flow_there - flow
    way = 0.5 * (way_before * _ease(full, shape_before, flow) + way * _ease(full, shape, flow_there))
    steep = 1.0 / (1.0 - (full * z) ** 2)
    part = way * steep
    mean = -math.expm1(-part) / part if part > 1e-6 else 1.0 - 0.5 * part
    there = z + (part * mean * (flow - _flowing(full, z)) + (1.0 - mean) * more) / steep
    # It never passes what yields; a tangent may, where the flow sets in beyond it.
    return min(max(there, min(z, shape_before, shape), -most), max(z, shape_before, shape), most)


def _flowing(full: float, z: float) -> float:
    """What flows at z along a tanh that is full at 1 / full; in proportion where that is nowhere."""
    return math.atanh(full * z) / full if full > 0.0 else z


def _ease(full: float, shape: float, flow: float) -> float:
    """What a pace is multiplied by, for how freely it flows: its shape over what flows there."""
    if abs(shape) >= SMALLEST_SHAPE:
        return abs(shape / flow)
    return SMALLEST_SHAPE / _flowing(full, SMALLEST_SHAPE)


def saturated(before: float, length_m: float, way_m: float) -> float:
    """Dahl's part, Wen's with n = 1 and beta = 0, after a way in one direction. Exact; at rest it stays."""
    if way_m == 0.0:
        return before
    return before - (math.copysign(1.0, way_m) - before) * math.expm1(-abs(way_m) / max(length_m, SHORTEST_M))


def rounded(before: float, length_m: float, way_m: float) -> float:
    """Bouc and Wen's part with n = 2 and beta = gamma: straight down to 0, then as a tanh. Exact."""
    way = abs(way_m) / max(length_m, SHORTEST_M)
    sign = math.copysign(1.0, way_m)
    share = sign * before
    if share < 0.0:
        down = min(way, -share)
        share += down
        way -= down
    if share >= 0.0 and way > 0.0:
        more = math.tanh(way)
        share = (share + more) / (1.0 + share * more)
    return sign * share


def sharp(before: float, length_m: float, way_m: float) -> float:
    """Wen's part as n grows: straight until it yields, at once. Exact."""
    return min(max(before + way_m / max(length_m, SHORTEST_M), -1.0), 1.0)
