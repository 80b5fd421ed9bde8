"""Rebound asymmetry: compression has another f than rebound."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

SMALLEST_FACTOR = 0.05


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    velocity_m_s: float,
    displacement_m: float,
    current_a: float,
    temperature_c: float,
    dt_s: float,
) -> float:
    """The factor on the static force."""
    if velocity_m_s >= 0.0:
        return 1.0
    on_a = max(current_a, 0.0)  # a sensor's noise about 0 A is no current
    bent_a = on_a / math.pow(1.0 + math.pow(p[2] * on_a, p[4]), 1.0 / p[4])
    change = p[0] + p[1] * bent_a + p[3] * bent_a * bent_a + p[5] * (on_a - bent_a)
    return max(1.0 + change, SMALLEST_FACTOR)


def _guesses(_: Ranges) -> list[Vector]:
    # The same at all currents, growing and levelling off, and growing late, then sharply level.
    return [
        (-0.15, 0.0, 0.0, 0.0, 1.0, 0.0),
        (0.0, -0.3, 1.0, 0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0, -0.3, 2.0, 0.0),
    ]


EFFECT = Effect(
    name="rebound_asymmetry",
    stage=Stage.FACTOR,
    summary="Compression is damped by another force than rebound, in a ratio that may change with current.",
    equation=(
        "factor = 1 in rebound (v >= 0), in compression (v < 0) "
        "1 + change + change_per_a j + change_per_a2 j^2 + change_last_per_a (i1 - j), "
        f"at least {SMALLEST_FACTOR:g}; "
        "j = i1 / (1 + (bend i1)^sharpness)^(1/sharpness)"
    ),
    source="Separate rebound and compression characteristics; Dixon, The Shock Absorber Handbook.",
    parameters=(
        Parameter(
            "compression_change",
            "1",
            0.0,
            -0.9,
            3.0,
            -0.15,
            "relative change of the force at 0 A",
            linear=True,
        ),
        Parameter(
            "compression_change_per_a",
            "1/A",
            0.0,
            -50.0,
            50.0,
            0.0,
            "what each ampere adds to it, at small currents",
            0.03,
            linear=True,
        ),
        Parameter("bend_per_a", "1/A", 1.0, 0.0, 100.0, 1.0, "how soon that levels off with current", 0.5),
        Parameter(
            "compression_change_per_a2",
            "1/A^2",
            0.0,
            -500.0,
            500.0,
            0.0,
            "how it turns, where one direction saturates later",
            0.1,
            linear=True,
            optional=True,
        ),
        Parameter(
            "sharpness",
            "1",
            1.0,
            1.0,
            6.0,
            1.0,
            "how sharply it levels off",
            0.5,
            optional=True,
        ),
        Parameter(
            "compression_change_last_per_a",
            "1/A",
            0.0,
            -50.0,
            50.0,
            0.0,
            "what each ampere adds to it at large currents, where the rest has levelled off",
            0.03,
            linear=True,
            optional=True,
        ),
    ),
    step=step,
    guesses=_guesses,
    shape_over=frozenset({"current"}),
    inverse=Undo.DIVIDE,
    inverse_note="The wish is divided by the factor, repeated until current and factor agree.",
)
