"""Off-state backbone: with little current the force over velocity has another knee and slope."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

SMALLEST_FACTOR = 0.01
MOST_FADE_A = 1.0
OFF = 0.95  # of that ...
OFF_SHARE = 0.8  # ... and of the currents seen: an off state is over by then


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
    off = 1.0 - current_a / p[3]
    if off <= 0.0:
        return 1.0
    ratio = velocity_m_s / p[2]
    change = p[0] / (1.0 + ratio * ratio) + p[1] * math.pow(abs(velocity_m_s), p[4])
    if velocity_m_s < 0.0:
        change += p[5]
    return max(1.0 + off * change, SMALLEST_FACTOR)


def _plausible(p: Vector, ranges: Ranges) -> bool:
    """The off state ends: a backbone that changes with all of the current is something else's."""
    return p[3] < min(OFF * MOST_FADE_A, OFF_SHARE * ranges.current_a)


EFFECT = Effect(
    name="off_state_backbone",
    stage=Stage.FACTOR,
    summary="Near 0 A the fluid flows rather than yields: another force below the knee, another slope above.",
    equation=(
        "factor = 1 + off (low_speed_change / (1 + (v / knee)^2) + growth |v|^power"
        f" [+ compression_change if v < 0]), at least {SMALLEST_FACTOR:g}; "
        "off = 1 - i1 / fade_current up to the fade current, then 0"
    ),
    source="The separable model's open point: its off-state error of 12 to 15 %. An empirical form.",
    parameters=(
        Parameter(
            "low_speed_change",
            "1",
            0.0,
            -0.99,
            3.0,
            -0.4,
            "relative change of the force at v = 0",
            linear=True,
        ),
        Parameter(
            "growth_s_m", "s/m", 0.0, -2.0, 10.0, 0.5, "relative growth above the knee, at 1 m/s", linear=True
        ),
        Parameter(
            "knee_m_s", "m/s", 0.05, 0.002, 1.0, 0.05, "velocity at which the low-speed change is half"
        ),
        Parameter(
            "fade_current_a", "A", 0.4, 0.02, MOST_FADE_A, 0.4, "current from which g is as when on", 0.1
        ),
        Parameter("power", "1", 1.0, 0.3, 3.0, 1.0, "exponent of that growth", optional=True),
        Parameter(
            "compression_change",
            "1",
            0.0,
            -0.9,
            3.0,
            0.0,
            "what is added to the change in compression",
            0.03,
            linear=True,
            optional=True,
        ),
    ),
    step=step,
    shape_over=frozenset({"current"}),
    plausible=_plausible,
    inverse=Undo.DIVIDE,
    inverse_note="The wish is divided by the factor, repeated until current and factor agree.",
)
