"""Skyhook laws: the body is damped as if against the sky, as far as a damper between body and wheel can.

The ideal force is c_sky * v_body on the body; a damper gives it only while v_body * v_rel > 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from mrctl.control.base import ForceLaw, Law, Motion, Parameter, ParameterValue
from mrctl.control.parameters import number
from mrctl.control.semi_active import (
    DAMPING_BOUND_N_S_M,
    MAXIMUM,
    MINIMUM,
    damping_bounds,
    dissipative_part,
    within_damping,
)

SKY = Parameter(
    "sky_n_s_m", "N s/m", 3000.0, 0.0, DAMPING_BOUND_N_S_M, "damping between the body and the sky"
)
BLEND = Parameter(
    "blend_m_s", "m/s", 0.05, 1e-4, 10.0, "relative velocity over which the force is faded in from 0"
)


def _two_state(values: Mapping[str, ParameterValue]) -> ForceLaw:
    low, high = damping_bounds(values)

    def force(motion: Motion) -> float:
        v = motion.relative_velocity_m_s
        return (high if motion.body_velocity_m_s * v > 0.0 else low) * v

    return force


def _continuous(values: Mapping[str, ParameterValue]) -> ForceLaw:
    low, high = damping_bounds(values)
    sky = number(values, SKY.name)

    def force(motion: Motion) -> float:
        v = motion.relative_velocity_m_s
        return within_damping(dissipative_part(sky * motion.body_velocity_m_s, v), v, low, high)

    return force


def _no_jerk(values: Mapping[str, ParameterValue]) -> ForceLaw:
    sky, blend, low = number(values, SKY.name), number(values, BLEND.name), number(values, MINIMUM.name)

    def force(motion: Motion) -> float:
        v = motion.relative_velocity_m_s
        shaped = sky * motion.body_velocity_m_s * math.tanh(abs(v) / blend)
        return within_damping(dissipative_part(shaped, v), v, low, math.inf)

    return force


TWO_STATE = Law(
    name="skyhook_two_state",
    summary="firm while damping between body and wheel also damps the body, else soft",
    source="Karnopp, Crosby, Harwood: Vibration control using semi-active force generators, 1974, on/off",
    parameters=(
        MINIMUM,
        Parameter(MAXIMUM.name, MAXIMUM.unit, 5000.0, MAXIMUM.low, MAXIMUM.high, "damping in the firm state"),
    ),
    needs=frozenset({"body_velocity"}),
    make=_two_state,
    continuous=False,
)

CONTINUOUS = Law(
    name="skyhook_continuous",
    summary="the skyhook force itself wherever it dissipates, between a smallest and a largest damping",
    source="Karnopp, Crosby, Harwood: Vibration control using semi-active force generators, 1974",
    parameters=(SKY, MINIMUM, MAXIMUM),
    needs=frozenset({"body_velocity"}),
    make=_continuous,
)

NO_JERK = Law(
    name="skyhook_no_jerk",
    summary="skyhook faded in with the relative velocity, so that no sign change makes the force jump",
    source="Ahmadian, Song, Southward: No-jerk skyhook control methods for semiactive suspensions, 2004",
    parameters=(SKY, BLEND, MINIMUM),
    needs=frozenset({"body_velocity"}),
    make=_no_jerk,
)
