"""Cavitation: in compression the gas pressure cannot push more fluid through, and the force stops growing."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

NO_LIMIT_N = 1e6


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    force_n: float,
    velocity_m_s: float,
    displacement_m: float,
    dt_s: float,
) -> float:
    """The force in N: as it is down to limit less knee, then bent, in a parabola, towards the limit."""
    over = -force_n - p[0] + p[1]
    if over <= 0.0:
        return force_n
    if over >= 2.0 * p[1]:
        return -p[0]
    return force_n + over * over / (4.0 * p[1])


def _guesses(ranges: Ranges) -> list[Vector]:
    # Where it cavitates, the limit is about the largest compression force seen.
    most = ranges.compression_force_n or ranges.force_n
    return [(share * most, 0.05 * most) for share in (1.0, 0.95, 0.85, 0.7)]


EFFECT = Effect(
    name="cavitation",
    stage=Stage.LIMIT,
    summary="The compression force cannot exceed what the gas pressure holds up; beyond, vapour forms.",
    equation="F >= -limit, with a parabola from limit - knee to limit + knee",
    source="The chamber's pressure falls to the vapour's; Dixon, The Shock Absorber Handbook, 2nd ed.",
    parameters=(
        Parameter("limit_n", "N", NO_LIMIT_N, 50.0, NO_LIMIT_N, 1000.0, "largest compression force"),
        Parameter("knee_n", "N", 50.0, 1.0, 5e3, 50.0, "half width of the transition to it"),
    ),
    step=step,
    inverse=Undo.NOT_UNDONE,
    inverse_note="No current lifts the limit: wishes beyond it fall short by what exceeds it.",
    guesses=_guesses,
)
