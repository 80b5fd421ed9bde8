"""Preyield stiffness: the fluid stretches elastically before it yields."""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.chains import (
    FULL,
    SHORTEST_M,
    SMALLEST_SHAPE,
    pace_of,
    rounded,
    saturated,
    sharp,
    speed_per_shape,
    stretched,
)
from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector
from mrctl.model.ways import ways

# A force that has to be divided by its elastic share grows at most this much.
LARGEST_GAIN = 5.0
# What is elastic beside g follows it at once over no length, and over this or less as if at once.
AT_ONCE_M = 1e-9


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
        s[7] = speed_per_shape(s[7], yielding, velocity_m_s)
        pace = pace_of(p[2], s[7], yielding, velocity_m_s)
        elastic = stretched(p[9], s[0], s[1], yielding, s[6] * unit, pace * unit)
        s[6] = pace
    s[0] = elastic
    s[1] = yielding
    if p[4] > 0.0:  # else nothing hangs on them
        for way_m in ways(s[8], velocity_m_s, dt_s)[1:]:  # of no part that has no weight
            if p[5] < 1.0 and p[6] < 1.0:
                s[2] = saturated(s[2], length, way_m)
            if p[5] > 0.0 and p[6] < 1.0:
                s[3] = rounded(s[3], length, way_m)
            if p[6] > 0.0:
                s[4] = sharp(s[4], length, way_m)
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
    per_shape = speed_per_shape(0.0, yielding, velocity_m_s)
    pace = pace_of(p[2], per_shape, yielding, velocity_m_s)
    return [yielding, yielding, sign, sign, sign, level_n, pace, per_shape, velocity_m_s]


def _idle(p: Vector) -> list[int]:
    """What the part that creeps, each beside it, or a new field would need, where it is not there."""
    of_creep = [] if p[3] > 0.0 else [0, 1, 6, 7]
    of_plastic = [] if p[4] > 0.0 else [2, 3, 4, 8]
    parts = {2: (1.0 - p[6]) * (1.0 - p[5]), 3: (1.0 - p[6]) * p[5], 4: p[6]}
    weightless = [state for state, part in parts.items() if part <= 0.0]
    return [*of_creep, *of_plastic, *weightless, *([] if p[8] > 0.0 else [5])]


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
        pace = pace_of(p[2], speed_per_shape(s[7], s[1], velocity_m_s), s[1], velocity_m_s)
        elastic += stretched(p[9], kept * s[0], s[1], s[1], s[6] * unit, pace * unit) - s[1]
    y, u, w = kept * s[2], kept * s[3], kept * s[4]
    for way_m in ways(s[8], velocity_m_s, dt_s)[1:]:
        y = saturated(y, length, way_m)
        u = rounded(u, length, way_m)
        w = sharp(w, length, way_m)
    made = _together(p, shape, elastic, y, u, w)
    if abs(shape) >= LARGEST_GAIN * abs(made):
        return wanted_n * math.copysign(LARGEST_GAIN, shape * made)
    return wanted_n * shape / made


def _kept(p: Sequence[float], s: Sequence[float], level_n: float) -> float:
    """What what is stretched is of another f h, where its force stays rather than its strain."""
    return (s[5] / level_n) ** p[8] if p[8] > 0.0 else 1.0


def _together(p: Sequence[float], shape: float, elastic: float, y: float, u: float, w: float) -> float:
    """The force over f h."""
    smooth = (1.0 - p[5]) * y + p[5] * u
    return (1.0 - p[3]) * shape + p[3] * elastic + p[4] * ((1.0 - p[6]) * smooth + p[6] * w)


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


def _far(reach: Ranges) -> list[Vector]:
    # A spring in series with what yields: no tangent of a base whose g has made up for it shows a knee. And
    # at one frequency a filter and g make up for any shape that turns round late.
    dahl, maxwell, *_ = _guesses(reach)
    return [(5e-4, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.8), dahl, maxwell]


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
    idle=_idle,
    undo=undo,
    guesses=_guesses,
    far=_far,
    derived=_derived,
    rescaled=_rescaled,
)
