"""End stop: bump rubber or hydraulic stop at both ends of the stroke."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import (
    COMPRESSION_CHANGE,
    FORCE_LAG,
    Effect,
    Parameter,
    Ranges,
    Stage,
    Undo,
    Vector,
)
from mrctl.model.lag import lagged

UNIT_M = 1e-3  # the stop's force is stated at this depth
OUTER_SHARE = 0.35  # of the largest displacement seen; a derived displacement may be off its middle
OTHER_STOPS = (0.95, 0.85, 0.7)  # of the largest displacement, where the other stop may be
CONTACT_M = 2e-4  # depth over which the stop's damping comes in, so that the force has no step


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
    """The stop's force in N; it pushes back and never pulls."""
    s[0] = lagged(_steady(p, velocity_m_s, displacement_m), s[0], p[5], dt_s)
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
    return [_steady(p, velocity_m_s, displacement_m)]


def _steady(p: Sequence[float], velocity_m_s: float, displacement_m: float) -> float:
    x = displacement_m - p[4]
    depth = abs(x) - p[0]
    if depth <= 0.0:
        return 0.0
    outward = velocity_m_s if x > 0.0 else -velocity_m_s
    force = p[1] * math.pow(depth / UNIT_M, p[2]) + p[3] * outward * (1.0 - math.exp(-depth / CONTACT_M))
    if force <= 0.0:
        return 0.0
    return force if x > 0.0 else -force * (1.0 + p[6])


def _guesses(ranges: Ranges) -> list[Vector]:
    reach = ranges.displacement_m
    both: list[Vector] = [
        (share * reach, 300.0, 1.5, 500.0, 0.0, 0.0, 0.0) for share in (0.95, 0.85, 0.7, 0.6, 0.5)
    ]
    # One stop only: the middle is moved away from it, so that the other is never reached.
    one: list[Vector] = [
        ((share + 0.3) * reach, 300.0, 1.5, 500.0, side * 0.3 * reach, 0.0, 0.0)
        for share in (0.9, 0.75, 0.6, 0.45)
        for side in (-1.0, 1.0)
    ]
    return both + one


def _beside(p: Vector, ranges: Ranges) -> list[Vector]:
    """Where only one stop is ever reached, the same one with the other within the stroke."""
    reach = ranges.displacement_m
    outer, inner = p[4] + p[0], p[4] - p[0]
    if (outer > reach) == (inner < -reach):
        return []
    found: list[Vector] = []
    for share in OTHER_STOPS:
        ends = (share * reach, inner) if outer > reach else (outer, -share * reach)
        found.append((0.5 * (ends[0] - ends[1]), *p[1:4], 0.5 * (ends[0] + ends[1]), *p[5:]))
    return found


def _plausible(p: Vector, ranges: Ranges) -> bool:
    """A stop stands in the outer half of the stroke; what pushes from the middle on is a spring."""
    return p[0] - abs(p[4]) > OUTER_SHARE * ranges.displacement_m


EFFECT = Effect(
    name="end_stop",
    stage=Stage.ROD,
    summary="Near either end of the stroke a stop pushes back, steeply and with some damping.",
    equation=(
        f"lag dF/dt + F = sign(y) max(force_at_1mm (d / {1e3 * UNIT_M:g} mm)^exponent "
        f"+ damping sign(y) v (1 - exp(-d / {1e3 * CONTACT_M:g} mm)), 0) "
        "where d = |y| - clearance > 0, else 0; y = x - middle; "
        "in compression (y < 0) 1 + compression_change times that"
    ),
    source=(
        "Power-law contact with damping; Hunt, Crossley, J. Appl. Mech. 42 (1975). A hydraulic one may lag "
        "as the force behind H does."
    ),
    parameters=(
        Parameter("clearance_m", "m", 0.02, 0.0, 0.5, 0.02, "displacement at which the stop begins", 1e-3),
        Parameter("force_at_1mm_n", "N", 0.0, 0.0, 1e5, 500.0, "force 1 mm deep in the stop", linear=True),
        Parameter("exponent", "1", 1.5, 1.0, 3.0, 1.5, "how steeply it grows", 0.3),
        Parameter("damping_n_s_m", "N*s/m", 0.0, 0.0, 5e4, 500.0, "damping in the stop", linear=True),
        Parameter("middle_m", "m", 0.0, -0.5, 0.5, 0.0, "displacement halfway between the stops", 1e-3),
        FORCE_LAG,
        COMPRESSION_CHANGE,
    ),
    step=step,
    start=start,
    states=("force, N",),
    shape_over=frozenset({"stroke", "velocity"}),
    inverse=Undo.SUBTRACT,
    inverse_note="Its force at the measured displacement is taken off the wish.",
    needs=frozenset({"displacement"}),
    guesses=_guesses,
    beside=_beside,
    plausible=_plausible,
)
