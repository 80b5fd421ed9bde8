"""Preyield stiffness: the fluid stretches elastically before it yields."""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector
from mrctl.model.ways import ways

# A force that has to be divided by its elastic share grows at most this much.
LARGEST_GAIN = 5.0
# Below this part of the shape the speed over it is as it was: near rest both are next to nothing.
SMALLEST_SHAPE = 1e-3
# The plastic part turns round over no less than this: with no length at all it would jump at every reversal.
SHORTEST_M = 1e-5
# What is elastic beside g follows it at once over no length, and over this or less as if at once.
AT_ONCE_M = 1e-9
# What flows along a tanh is full at infinite speed: taken to this part of it.
FULL = 0.999


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    force_n: float,
    velocity_m_s: float,
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,
    dt_s: float,
) -> float:
    """The force in N; exact for a shape that runs straight over the sample's displacement."""
    length = p[0] + p[1] * level_n
    if length <= 0.0 and p[4] <= 0.0:
        return force_n
    if p[8] > 0.0:
        kept = _kept(p, s, level_n)
        for k in range(5):
            s[k] *= kept
        s[5] = level_n
    shape = force_n / level_n
    elastic = yielding = shape - p[7] * velocity_m_s
    if length > 0.0 and p[3] > 0.0:
        unit = dt_s / max(length, AT_ONCE_M)
        s[7] = _per_shape(s[7], yielding, velocity_m_s)
        pace = _pace(p, s[7], yielding, velocity_m_s)
        elastic = _stretched(p, s[0], s[1], yielding, s[6] * unit, pace * unit)
        s[6] = pace
    s[0] = elastic
    s[1] = yielding
    if p[4] > 0.0:  # else nothing hangs on them
        for way_m in ways(s[8], velocity_m_s, dt_s)[1:]:
            s[2] = _saturated(s[2], length, way_m)
            s[3] = _rounded(s[3], length, way_m)
            s[4] = _sharp(s[4], length, way_m)
    s[8] = velocity_m_s
    return _together(p, shape, elastic + p[7] * velocity_m_s, s[2], s[3], s[4]) * level_n


def start(
    p: Sequence[float],
    force_n: float,
    velocity_m_s: float,
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,
    dt_s: float,  # noqa: ARG001 - the stage's
) -> list[float]:
    """Yielded: the elastic shape is the static one, the plastic part as the motion; at rest it is 0."""
    sign = math.copysign(1.0, velocity_m_s) if velocity_m_s != 0.0 else 0.0
    yielding = force_n / level_n - p[7] * velocity_m_s
    per_shape = _per_shape(0.0, yielding, velocity_m_s)
    pace = _pace(p, per_shape, yielding, velocity_m_s)
    return [yielding, yielding, sign, sign, sign, level_n, pace, per_shape, velocity_m_s]


def undo(
    p: Sequence[float],
    s: MutableSequence[float],
    wanted_n: float,
    velocity_m_s: float,
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,
    dt_s: float,
) -> float:
    """The static force in N whose current makes the wanted force with the elastic shapes of this moment."""
    length = p[0] + p[1] * level_n
    if length <= 0.0 and p[4] <= 0.0:
        return wanted_n
    # Of the sample before: this one's is what the current is sought for.
    kept = _kept(p, s, level_n)
    elastic = shape = s[1] + p[7] * velocity_m_s
    if length > 0.0:
        unit = dt_s / max(length, AT_ONCE_M)
        pace = _pace(p, _per_shape(s[7], s[1], velocity_m_s), s[1], velocity_m_s)
        elastic += _stretched(p, kept * s[0], s[1], s[1], s[6] * unit, pace * unit) - s[1]
    plastic, rounded, sharp = kept * s[2], kept * s[3], kept * s[4]
    for way_m in ways(s[8], velocity_m_s, dt_s)[1:]:
        plastic = _saturated(plastic, length, way_m)
        rounded = _rounded(rounded, length, way_m)
        sharp = _sharp(sharp, length, way_m)
    made = _together(p, shape, elastic, plastic, rounded, sharp)
    if abs(shape) >= LARGEST_GAIN * abs(made):
        return wanted_n * math.copysign(LARGEST_GAIN, shape * made)
    return wanted_n * shape / made


def _kept(p: Sequence[float], s: Sequence[float], level_n: float) -> float:
    """What what is stretched is of another f h, where its force stays rather than its strain."""
    return (s[5] / level_n) ** p[8] if p[8] > 0.0 else 1.0


def _per_shape(before_m_s: float, shape: float, velocity_m_s: float) -> float:
    """The speed in m/s over the static shape there; where both are next to nothing, as it was before."""
    size = abs(shape)
    return abs(velocity_m_s) / size if size >= SMALLEST_SHAPE else before_m_s


def _pace(p: Sequence[float], per_shape_m_s: float, shape: float, velocity_m_s: float) -> float:
    """The speed in m/s at which the elastic shape nears the static one: |v| / |shape|^creep."""
    size, speed = abs(shape), abs(velocity_m_s)
    if size >= SMALLEST_SHAPE:
        return float(speed / size ** p[2])
    return float(speed ** (1.0 - p[2]) * per_shape_m_s ** p[2])


def _stretched(
    p: Sequence[float], before: float, shape_before: float, shape: float, way_before: float, way: float
) -> float:
    """The elastic shape after a sample, over which what the static one makes flow runs straight.

    way_before, way: the sample's displacement in lengths, at the pace of its beginning and of its end. Behind
    a knee what flows at z runs away as z nears the most; it is taken along its tangent.
    """
    full = math.sqrt(p[9])
    most = FULL / full if full > 0.0 else math.inf
    z = min(max(before, -most), most)
    flow = _flowing(full, min(max(shape_before, -most), most))
    more = _flowing(full, min(max(shape, -most), most)) - flow
    way = 0.5 * (way_before * _ease(full, shape_before) + way * _ease(full, shape))
    steep = 1.0 / (1.0 - (full * z) ** 2)
    part = way * steep
    mean = -math.expm1(-part) / part if part > 1e-6 else 1.0 - 0.5 * part
    there = z + (part * mean * (flow - _flowing(full, z)) + (1.0 - mean) * more) / steep
    # It never passes what yields; a tangent may, where the flow sets in beyond it.
    return min(max(there, min(z, shape_before, shape), -most), max(z, shape_before, shape), most)


def _flowing(full: float, z: float) -> float:
    """What flows at z along a tanh that is full at 1 / full; in proportion where that is nowhere."""
    return math.atanh(full * z) / full if full > 0.0 else z


def _ease(full: float, shape: float) -> float:
    """What a pace is multiplied by, for how freely it flows: its shape over what flows there."""
    if full <= 0.0:
        return 1.0
    size = max(abs(shape), SMALLEST_SHAPE)
    return full * size / math.atanh(min(full * size, FULL))


def _saturated(before: float, length_m: float, way_m: float) -> float:
    """The plastic part after a way in one direction, exactly; where nothing moves it stays."""
    if way_m == 0.0:
        return before
    return before - (math.copysign(1.0, way_m) - before) * math.expm1(-abs(way_m) / max(length_m, SHORTEST_M))


def _rounded(before: float, length_m: float, way_m: float) -> float:
    """The same with n = 2 and beta = gamma: straight down to 0, then as a tanh. Exact."""
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


def _sharp(before: float, length_m: float, way_m: float) -> float:
    """The same as n grows: straight until it yields, at once. Exact."""
    return min(max(before + way_m / max(length_m, SHORTEST_M), -1.0), 1.0)


def _together(
    p: Sequence[float], shape: float, elastic: float, plastic: float, rounded: float, sharp: float
) -> float:
    """The force over f h."""
    smooth = (1.0 - p[5]) * plastic + p[5] * rounded
    return (1.0 - p[3]) * shape + p[3] * elastic + p[4] * ((1.0 - p[6]) * smooth + p[6] * sharp)


def _rescaled(p: Vector, factor: float) -> Vector:
    """Exact unless a plastic part stands beside a creeping one: they share one length."""
    length = factor ** p[2]
    plastic, flow, knee = p[4] / factor, p[7] / factor, p[9] * factor**2
    return p[0] * length, p[1] * length / factor, p[2], p[3], plastic, p[5], p[6], flow, p[8], knee


def _guesses(_: Ranges) -> list[Vector]:
    # The shape itself turns round, or a part beside it, which g then does not hold: as in Bouc-Wen.
    return [
        (5e-4, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (5e-4, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (1e-3, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0),
        (1e-3, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0),
        (5e-4, 0.0, 0.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0, 0.0),
        (1e-3, 0.0, 0.0, 0.0, 0.3, 0.0, 1.0, 0.0, 0.0, 0.0),
    ]


def _far(_: Ranges) -> list[Vector]:
    # A spring in series with what yields: no tangent of a base whose g has made up for it shows a knee.
    return [(5e-4, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.8)]


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    length = p[0] + 1e3 * p[1]
    elastic_n = 1e3 * (p[3] + p[4])
    if length <= 0.0 or elastic_n <= 0.0:
        return {}
    return {"stiffness at f h = 1 kN": (elastic_n / length, "N/m")}


EFFECT = Effect(
    name="preyield_stiffness",
    stage=Stage.YIELD,
    summary="After a reversal the force turns round over a length, not at once: the fluid is elastic first.",
    equation=(
        "F = f h ((1 - share) g + share (z + flow v) "
        "+ plastic ((1 - sharp) ((1 - rounded) y + rounded u) + sharp w)), "
        "dz/dt = |v| (r - |r| atanh(k z) / atanh(k |r|)) / (|r|^creep length), r = g - flow v, k = knee^0.5, "
        f"|v|/|r| as it was where |r| < {SMALLEST_SHAPE:g}, k |r| at most {FULL:g} in it; "
        "knee 0: |v| (r - z) over that, "
        "dy/dt = |v| (sign(v) - y) / length, "
        "du/dt = (v - (v |u| + |v| u) |u| / 2) / length, dw/dt = v / length within -1 to 1, "
        f"length = yield_length + compliance f h; for y, u and w at least {SHORTEST_M:g} m; "
        "as f h changes, z, y, u and w go with (f h)^-held"
    ),
    source=(
        "Dahl, AIAA Journal 14 (1976); for MR dampers Ikhouane, Dyke, Smart Mater. Struct. 16 (2007). "
        "creep 0: Dahl, turning round over a length; 1: a spring in series with the fluid (Maxwell), whose "
        "flow at z is taken along the chord of g, as in LuGre's model, or with a knee along a tanh that is "
        "full at knee^-0.5, as g is. "
        "y: Wen, J. Eng. Mech. Div. ASCE 102 (1976), with n = 1 and beta = 0, which is Dahl's; u: with n = 2 "
        "and beta = gamma; w: as n grows, a spring before Coulomb's friction, as in series with Bingham's "
        "damper; with share 0 they stand beside what follows the velocity at once, as in Spencer et al., "
        "J. Eng. Mech. 123 (1997). "
        "yield_length: the same strain at all currents, as in Bouc-Wen; compliance: the same stiffness. "
        "held 0: a new field makes the chains stiffer as they are strained, as Bouc-Wen's alpha does; 1: the "
        "state is a force, as in LuGre's model with a stiffness in N/m (Sakai et al., ACC 2003)."
    ),
    parameters=(
        Parameter("yield_length_m", "m", 0.0, 0.0, 0.02, 5e-4, "length over which the shape turns round"),
        Parameter(
            "compliance_m_n", "m/N", 0.0, 0.0, 2e-5, 0.0, "length that each newton of f h adds to it", 2e-7
        ),
        Parameter("creep", "1", 0.0, 0.0, 1.0, 0.0, "how far slow flow relaxes it: Dahl 0, Maxwell 1", 0.3),
        Parameter(
            "share",
            "1",
            1.0,
            0.0,
            1.0,
            1.0,
            "part of g that turns round so, the rest at once",
            0.3,
            optional=True,
        ),
        Parameter(
            "plastic",
            "1",
            0.0,
            0.0,
            10.0,
            0.0,
            "part beside g, full once yielded at any speed",
            0.05,
            linear=True,
            optional=True,
        ),
        Parameter(
            "rounded",
            "1",
            0.0,
            0.0,
            1.0,
            0.0,
            "share of that part which goes over as Bouc-Wen's with n = 2",
            0.3,
            linear=True,
            optional=True,
        ),
        Parameter(
            "sharp",
            "1",
            0.0,
            0.0,
            1.0,
            0.0,
            "share of that part which is elastic until it yields, at once",
            0.3,
            linear=True,
            optional=True,
        ),
        Parameter(
            "flow_s_m",
            "s/m",
            0.0,
            0.0,
            10.0,
            0.0,
            "slope of g that flow makes, which is not elastic",
            0.3,
            optional=True,
        ),
        Parameter(
            "held",
            "1",
            0.0,
            0.0,
            1.0,
            0.0,
            "what stays as the current changes: what is stretched 0, its force 1",
            0.3,
            optional=True,
        ),
        Parameter(
            "knee",
            "1",
            0.0,
            0.0,
            4.0,
            0.0,
            "how sharply flow sets in behind the spring: in proportion 0, as g that is full at knee^-0.5",
            0.3,
            optional=True,
            far=True,
        ),
    ),
    step=step,
    shape_over=frozenset({"stroke", "velocity"}),
    inverse=Undo.DIVIDE,
    inverse_note=(
        "The elastic shapes are followed in the model, and the current is sought for the force over their "
        f"sum in place of g, up to {LARGEST_GAIN:g} times; where that passes through 0 no current makes a "
        "force. Where g is small the current follows as slowly as without them, though the plastic part "
        "would give it a hold."
    ),
    start=start,
    states=(
        "elastic shape z, -1 to 1",
        "shape g, less its flow, of the sample before",
        "plastic part y, -1 to 1",
        "rounded part u, -1 to 1",
        "sharp part w, -1 to 1",
        "f h of the sample before, N",
        "pace of the sample before, m/s",
        "speed over shape, where that is not next to nothing, m/s",
        "velocity of the sample before, m/s",
    ),
    undo=undo,
    guesses=_guesses,
    far=_far,
    derived=_derived,
    rescaled=_rescaled,
)
