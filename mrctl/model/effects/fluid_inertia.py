"""Fluid inertia: the mass of fluid, and rod, that moves with the piston."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import FORCE_LAG, Effect, Parameter, Ranges, Stage, Undo, Vector
from mrctl.model.lag import lagged

TYPICAL_KG = 5.0


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
    """The inertia force in N."""
    s[0] = lagged(_steady(p, acceleration_m_s2), s[0], p[1], dt_s)
    return s[0]


def start(
    p: Sequence[float],
    velocity_m_s: float,
    displacement_m: float,
    acceleration_m_s2: float,
    current_a: float,
    temperature_c: float,
    dt_s: float,
) -> list[float]:
    """The force has followed."""
    return [_steady(p, acceleration_m_s2)]


def _steady(p: Sequence[float], acceleration_m_s2: float) -> float:
    return p[0] * acceleration_m_s2


def _guesses(ranges: Ranges) -> list[Vector]:
    return [(TYPICAL_KG, 0.0), (TYPICAL_KG, 6e-3)]


EFFECT = Effect(
    name="fluid_inertia",
    stage=Stage.ROD,
    summary="Fluid driven through a narrow gap has to be accelerated many times faster than the piston.",
    equation="lag dF/dt + F = mass a",
    source=(
        "Fluid column in a gap, m (Ap/Ag)^2: Peel, Stanway, Bullough, Smart Mater. Struct. 5 (1996). The "
        "chamber's compliance may make it lag as the force behind H does."
    ),
    parameters=(
        Parameter("mass_kg", "kg", 0.0, 0.0, 500.0, TYPICAL_KG, "apparent mass at the piston", linear=True),
        FORCE_LAG,
    ),
    step=step,
    start=start,
    states=("force, N",),
    inverse=Undo.SUBTRACT,
    inverse_note="Mass times acceleration is taken off the wish; velocity is differentiated if need be.",
    guesses=_guesses,
    needs=frozenset({"acceleration"}),
)
