"""Coulomb friction of seals and guides, with elastic presliding."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Stage, Undo, Vector


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
    """The friction force in N: Dahl's equation solved exactly over the sample."""
    if velocity_m_s != 0.0:
        side = 1.0 if velocity_m_s > 0.0 else -1.0
        s[0] = side + (s[0] - side) * math.exp(-abs(velocity_m_s) * dt_s / p[1])
    return p[0] * s[0]


def start(
    p: Sequence[float],
    velocity_m_s: float,
    displacement_m: float,
    acceleration_m_s2: float,
    current_a: float,
    temperature_c: float,
    dt_s: float,
) -> list[float]:
    """Slides fully in the direction of the first motion; unloaded at rest."""
    return [float((velocity_m_s > 0.0) - (velocity_m_s < 0.0))]


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    return {"presliding stiffness": (p[0] / p[1], "N/m")}


EFFECT = Effect(
    name="coulomb_friction",
    stage=Stage.ADDITIVE,
    summary="Seals and guides hold the rod with a constant force, elastic for a fraction of a millimetre.",
    equation="F = friction z, dz/dx = (1 - z sign(v)) / presliding",
    source="Dahl, AIAA Journal 14 (1976), with exponent 1.",
    parameters=(
        Parameter("friction_n", "N", 0.0, 0.0, 2e3, 50.0, "force while it slides", linear=True),
        Parameter("presliding_m", "m", 1e-4, 1e-6, 5e-3, 1e-4, "length over which the force turns round"),
    ),
    step=step,
    inverse=Undo.SUBTRACT,
    inverse_note="Its force, the presliding state followed from the velocity, is taken off the wish.",
    start=start,
    states=("share of the sliding force, -1 to 1",),
    derived=_derived,
)
