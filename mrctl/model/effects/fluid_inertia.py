"""Fluid inertia: the mass of fluid, and rod, that moves with the piston."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Stage, Undo


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
    return p[0] * acceleration_m_s2


EFFECT = Effect(
    name="fluid_inertia",
    stage=Stage.ADDITIVE,
    summary="Fluid driven through a narrow gap has to be accelerated many times faster than the piston.",
    equation="F = mass a",
    source="Fluid column in a gap, m (Ap/Ag)^2: Peel, Stanway, Bullough, Smart Mater. Struct. 5 (1996).",
    parameters=(
        Parameter("mass_kg", "kg", 0.0, 0.0, 500.0, 5.0, "apparent mass at the piston", linear=True),
    ),
    step=step,
    inverse=Undo.SUBTRACT,
    inverse_note="Mass times acceleration is taken off the wish; velocity is differentiated if need be.",
    needs=frozenset({"acceleration"}),
)
