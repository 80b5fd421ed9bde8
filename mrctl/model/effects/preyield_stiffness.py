"""Preyield stiffness: the fluid stretches elastically before it yields."""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Stage, Undo, Vector

# The lead asks for at most this many times the missing force.
LARGEST_LEAD = 10.0


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    force_n: float,
    velocity_m_s: float,
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,
    dt_s: float,
) -> float:
    """The force in N; exact for a static force that runs straight over the sample's displacement."""
    length = p[0] * level_n + p[1]
    if length <= 0.0:
        return force_n
    way = abs(velocity_m_s) * dt_s / length
    decay = math.exp(-way)
    mean = (1.0 - decay) / way if way > 1e-6 else 1.0 - 0.5 * way
    elastic = force_n - (force_n - s[1]) * mean + (s[0] - s[1]) * decay
    s[0] = elastic
    s[1] = force_n
    return elastic


def start(
    p: Sequence[float],  # noqa: ARG001 - the stage's
    force_n: float,
    velocity_m_s: float,  # noqa: ARG001 - the stage's
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,  # noqa: ARG001 - the stage's
    dt_s: float,  # noqa: ARG001 - the stage's
) -> list[float]:
    """Yielded: the force is the static one."""
    return [force_n, force_n]


def undo(
    p: Sequence[float],
    s: MutableSequence[float],
    wanted_n: float,
    velocity_m_s: float,
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,
    dt_s: float,
) -> float:
    """The static force in N that brings the elastic one to the wanted as fast as the largest lead allows."""
    length = p[0] * level_n + p[1]
    if length <= 0.0:
        return wanted_n
    share = 1.0 - math.exp(-abs(velocity_m_s) * dt_s / length)
    return s[0] + (wanted_n - s[0]) * (1.0 / share if share * LARGEST_LEAD > 1.0 else LARGEST_LEAD)


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    return {"stiffness": (1.0 / p[0], "N/m")} if p[0] > 0.0 else {}


EFFECT = Effect(
    name="preyield_stiffness",
    stage=Stage.YIELD,
    summary="After a reversal the force turns round over a length, not at once: the fluid is elastic first.",
    equation="dF/dx = sign(v) (f g h - F) / length, length = compliance f h + yield_length",
    source=(
        "Dahl, AIAA Journal 14 (1976), for MR dampers Ikhouane, Dyke, Smart Mater. Struct. 16 (2007); "
        "compliance: the same stiffness at all currents; yield_length: the same strain, as in Bouc-Wen."
    ),
    parameters=(
        Parameter("compliance_m_n", "m/N", 0.0, 0.0, 2e-5, 5e-7, "one over the stiffness before yield"),
        Parameter(
            "yield_length_m",
            "m",
            0.0,
            0.0,
            0.02,
            0.0,
            "length that does not grow with force",
            5e-4,
            held=True,
        ),
    ),
    step=step,
    inverse=Undo.LEAD,
    inverse_note=(
        f"The elastic force is followed in the model and overdriven by up to {LARGEST_LEAD:g} times "
        "what is missing; right after a reversal no current can turn it faster."
    ),
    start=start,
    states=("elastic force, N", "static force, N"),
    undo=undo,
    derived=_derived,
)
