"""Force offset: the load cell's zero, or a constant force of the damper."""
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
    """The constant force in N."""
    return p[0]


EFFECT = Effect(
    name="force_offset",
    stage=Stage.ROD,
    felt=False,
    summary="A constant force: the zero of the load cell, or a preload that does not change with stroke.",
    equation="F = offset",
    source="Zero error of a strain-gauge load cell (ISO 376).",
    parameters=(Parameter("offset_n", "N", 0.0, -2e3, 2e3, 30.0, "the force at rest", linear=True),),
    step=step,
    inverse=Undo.SUBTRACT,
    inverse_note=(
        "It is taken off the wish, which is then a force as that load cell would read it. "
        "Where the cell's zero alone is to blame, remove the effect before the calibration goes on a vehicle."
    ),
)
