"""Coulomb friction of seals and guides, with elastic presliding."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import FORCE_LAG, FORCE_SWING, Effect, Parameter, Ranges, Stage, Undo, Vector
from mrctl.model.lag import swung
from mrctl.model.ways import ways

REST_M_S = 2e-3  # well below it
HARDLY = 1e-6  # presliding lengths, over which a share hardly changes
SLOW_M_S = 5e-3  # where lubricated seals go over from sticking to sliding


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    velocity_m_s: float,
    displacement_m: float,
    acceleration_m_s2: float,
    current_a: float,
    temperature_c: float,
    dt_s: float,
) -> float:
    """The friction force in N: Dahl's equation solved exactly over the sample, more force at low speed.

    The velocity runs straight from sample to sample: what lags hears when in between it turned.
    """
    turned, out_m, back_m = ways(s[1], velocity_m_s, dt_s)
    there, mean = s[0], 0.0
    if turned > 0.0:
        out = out_m / p[1]
        there = _slid(s[0], out)
        mean = turned * _mean(s[0], there, out)
    back = back_m / p[1]
    end = _slid(there, back)
    mean += (1.0 - turned) * _mean(there, end, back)
    s[0], s[1] = end, velocity_m_s
    heard = _steady(p, (dt_s * end + p[4] * mean) / (dt_s + p[4]), velocity_m_s)
    force = swung(heard, s[2], s[3], p[4], p[5], dt_s)
    s[2], s[3] = force, s[2]
    return force


def start(
    p: Sequence[float],
    velocity_m_s: float,
    displacement_m: float,
    acceleration_m_s2: float,
    current_a: float,
    temperature_c: float,
    dt_s: float,
) -> list[float]:
    """Slides in the direction of the first motion; unloaded at rest, where a sensor's noise is no motion."""
    share = velocity_m_s * abs(velocity_m_s) / (velocity_m_s * velocity_m_s + REST_M_S * REST_M_S)
    force = _steady(p, share, velocity_m_s)
    return [share, velocity_m_s, force, force]


def _steady(p: Sequence[float], share: float, velocity_m_s: float) -> float:
    slow = velocity_m_s / p[3]
    return p[0] * share * (1.0 + p[2] * math.exp(-slow * slow))


def _slid(share: float, way: float) -> float:
    """The share of the sliding force after a way in presliding lengths, all in one direction."""
    if way == 0.0:
        return share
    side = 1.0 if way > 0.0 else -1.0
    return side + (share - side) * math.exp(-abs(way))


def _mean(share: float, end: float, way: float) -> float:
    """Its mean on that way: what dz/dx = (1 - z sign(v)) / presliding integrates to."""
    if abs(way) < HARDLY:
        return 0.5 * (share + end)
    side = 1.0 if way > 0.0 else -1.0
    return side - (end - share) / abs(way)


def _guesses(_: Ranges) -> list[Vector]:
    return [(50.0, 1e-4, 0.0, SLOW_M_S, 0.0, 0.0), (50.0, 1e-4, 0.3, SLOW_M_S, 0.0, 0.0)]


def _far(ranges: Ranges) -> list[Vector]:
    """A part of the force, which a base without it has in its g as a knee, and its lag in its filter."""
    points = ((0.3, 2e-4, 0.0, 0.0), (0.3, 1e-3, 0.0, 0.0), (0.1, 1e-5, 4e-3, 0.3))
    return [
        (share * ranges.force_n, presliding_m, 0.0, SLOW_M_S, lag_s, swing)
        for share, presliding_m, lag_s, swing in points
    ]


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    return {"presliding stiffness": (p[0] / p[1], "N/m")} if p[0] > 0.0 else {}


EFFECT = Effect(
    name="coulomb_friction",
    stage=Stage.ROD,
    summary="Seals and guides hold the rod with a constant force, elastic for a fraction of a millimetre.",
    equation=(
        "swing lag^2 d2F/dt2 + lag dF/dt + F = friction (1 + breakaway exp(-(v / slow)^2)) z, "
        "dz/dx = (1 - z sign(v)) / presliding"
    ),
    source=(
        "Dahl, AIAA Journal 14 (1976), with exponent 1; at low speed Stribeck's curve as in Canudas de Wit, "
        "Olsson, Astrom, Lischinsky, IEEE Trans. Autom. Control 40 (1995), which has gone by 0.1 m/s at the "
        "latest (Armstrong-Helouvry and others, Automatica 30 (1994)). A piston's seal inside the "
        "compliance of the chambers, or a slow load cell, makes it lag."
    ),
    parameters=(
        Parameter("friction_n", "N", 0.0, 0.0, 2e3, 50.0, "force while it slides", linear=True),
        Parameter("presliding_m", "m", 1e-4, 1e-6, 5e-3, 1e-4, "length over which the force turns round"),
        Parameter(
            "breakaway",
            "1",
            0.0,
            0.0,
            2.0,
            0.0,
            "how much more force there is at low speed, as a share",
            0.3,
            optional=True,
        ),
        Parameter(
            "slow_m_s",
            "m/s",
            SLOW_M_S,
            5e-4,
            0.1,
            SLOW_M_S,
            "speed at which most of that has gone",
            optional=True,
        ),
        FORCE_LAG,
        FORCE_SWING,
    ),
    step=step,
    shape_over=frozenset({"velocity"}),
    inverse=Undo.SUBTRACT,
    inverse_note="Its force, the presliding state followed from the velocity, is taken off the wish.",
    start=start,
    states=("share of the sliding force, -1 to 1", "velocity, m/s", "force, N", "force before, N"),
    guesses=_guesses,
    far=_far,
    derived=_derived,
)
