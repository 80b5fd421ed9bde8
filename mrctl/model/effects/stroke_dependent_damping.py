"""Stroke-dependent damping: bypass grooves or a tapered bore scale the damping along the stroke."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

SMALLEST_FACTOR = 0.05
ABRUPT = 1e-6  # a tail below which it is as good as none
USUAL_TAIL = 0.3  # of a taper like tanh, between a groove's like exp(-x^2) and one like 1 / (1 + x^2)


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
    y = displacement_m - p[3]
    if p[2] > 0.0:
        y = math.copysign(math.sqrt(levelled(math.pow(p[2] * y * y, p[4]), p[5]) / p[2]), y)
    return max(1.0 + y * (p[0] + p[1] * y), SMALLEST_FACTOR)


def levelled(w: float, tail: float) -> float:
    """How much of the change is there, 0 to 1: w for a small w, and the sooner 1 the less of a tail."""
    if tail <= ABRUPT:
        return 1.0 - math.exp(-w)
    if tail == 1.0:
        return w / (1.0 + w)
    return 1.0 - math.pow(1.0 + tail * w, -1.0 / tail)


def _guesses(ranges: Ranges) -> list[Vector]:
    reach = max(ranges.displacement_m, 1e-3)
    local = 0.5 / reach**2, 10.0 / reach**2
    return [
        (0.05 / reach, 0.1 / reach**2, 0.0, 0.0, 1.0, USUAL_TAIL),
        *((0.05 / reach, *local, centre * reach, 1.0, USUAL_TAIL) for centre in (0.0, -0.4, 0.4)),
    ]


EFFECT = Effect(
    name="stroke_dependent_damping",
    stage=Stage.FACTOR,
    summary="Damping changes along the stroke: bypass grooves, a tapered bore, a metering pin.",
    equation=(
        f"factor = 1 + slope y + curvature y^2, at least {SMALLEST_FACTOR:g}; "
        "y^2 = (1 - (1 + tail w)^(-1/tail)) / levelling with the sign of x - centre, "
        "w = (levelling (x - centre)^2)^flatness; without levelling y = x - centre"
    ),
    source=(
        "Position-dependent (bypass) dampers, Dixon, The Shock Absorber Handbook: to second order in x, "
        "and level again beyond 1 / sqrt(levelling) from its middle, where the groove or taper ends. "
        "A groove of one depth has a flat middle too. The less of a tail, the sooner it is level: as "
        "x^2 / (1 + x^2) with a tail of 1, as tanh^2 with about 0.3, as 1 - exp(-x^2) without."
    ),
    parameters=(
        Parameter("slope_per_m", "1/m", 0.0, -200.0, 200.0, 3.0, "change of damping a metre", linear=True),
        Parameter(
            "curvature_per_m2", "1/m^2", 0.0, -2e4, 2e4, 200.0, "growth towards both ends", linear=True
        ),
        Parameter(
            "levelling_per_m2", "1/m^2", 0.0, 0.0, 1e6, 0.0, "how soon the change levels off along x", 2e3
        ),
        Parameter(
            "centre_m",
            "m",
            0.0,
            -0.5,
            0.5,
            0.0,
            "where the groove or taper has its middle",
            5e-3,
            optional=True,
        ),
        Parameter(
            "flatness",
            "1",
            1.0,
            1.0,
            8.0,
            1.0,
            "how flat the middle is, and how sharply the groove ends",
            0.5,
            optional=True,
        ),
        Parameter(
            "tail",
            "1",
            1.0,
            0.0,
            1.0,
            1.0,
            "how far the change goes on beyond the groove's or taper's end",
            0.3,
            optional=True,
        ),
    ),
    step=step,
    shape_over=frozenset({"stroke"}),
    inverse=Undo.DIVIDE,
    inverse_note="The wish is divided by the factor at the measured displacement.",
    needs=frozenset({"displacement"}),
    guesses=_guesses,
)
