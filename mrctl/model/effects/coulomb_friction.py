"""Coulomb friction of seals and guides, with elastic presliding."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

REST_M_S = 2e-3  # well below it
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
    """The friction force in N: Dahl's equation solved exactly over the sample, more force at low speed."""
    if velocity_m_s != 0.0:
        side = 1.0 if velocity_m_s > 0.0 else -1.0
        s[0] = side + (s[0] - side) * math.exp(-abs(velocity_m_s) * dt_s / p[1])
    slow = velocity_m_s / p[3]
    return p[0] * s[0] * (1.0 + p[2] * math.exp(-slow * slow))


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
    return [velocity_m_s * abs(velocity_m_s) / (velocity_m_s * velocity_m_s + REST_M_S * REST_M_S)]


def _guesses(_: Ranges) -> list[Vector]:
    return [(50.0, 1e-4, 0.0, SLOW_M_S), (50.0, 1e-4, 0.3, SLOW_M_S)]


def _far(ranges: Ranges) -> list[Vector]:
    """A fair part of the force, which a base without it has in its g as a knee."""
    return [(0.3 * ranges.force_n, presliding_m, 0.0, SLOW_M_S) for presliding_m in (2e-4, 1e-3)]


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    return {"presliding stiffness": (p[0] / p[1], "N/m")} if p[0] > 0.0 else {}


EFFECT = Effect(
    name="coulomb_friction",
    stage=Stage.ROD,
    summary="Seals and guides hold the rod with a constant force, elastic for a fraction of a millimetre.",
    equation="F = friction (1 + breakaway exp(-(v / slow)^2)) z, dz/dx = (1 - z sign(v)) / presliding",
    source=(
        "Dahl, AIAA Journal 14 (1976), with exponent 1; at low speed Stribeck's curve as in Canudas de Wit, "
        "Olsson, Astrom, Lischinsky, IEEE Trans. Autom. Control 40 (1995)."
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
            0.05,
            SLOW_M_S,
            "speed at which most of that has gone",
            optional=True,
        ),
    ),
    step=step,
    shape_over=frozenset({"velocity"}),
    inverse=Undo.SUBTRACT,
    inverse_note="Its force, the presliding state followed from the velocity, is taken off the wish.",
    start=start,
    states=("share of the sliding force, -1 to 1",),
    guesses=_guesses,
    far=_far,
    derived=_derived,
)
