"""Groundhook, and its mix with skyhook: the wheel is damped as if against the ground.

The ideal force on the wheel is -c_ground * v_wheel. The damper's force F > 0 pulls the wheel up, hence
F = -c_ground * v_wheel, as far as it dissipates; v_wheel = v_body - v_rel.
"""

from __future__ import annotations

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
from mrctl.control.skyhook import SKY

GROUND = Parameter(
    "ground_n_s_m", "N s/m", 2000.0, 0.0, DAMPING_BOUND_N_S_M, "damping between the wheel and the ground"
)
SHARE = Parameter("sky_share", "1", 0.5, 0.0, 1.0, "share of skyhook: 1 is skyhook alone, 0 groundhook alone")


def _mix(sky_n_s_m: float, ground_n_s_m: float, low_n_s_m: float, high_n_s_m: float) -> ForceLaw:
    def force(motion: Motion) -> float:
        v, body = motion.relative_velocity_m_s, motion.body_velocity_m_s
        wish = dissipative_part(sky_n_s_m * body, v) + dissipative_part(-ground_n_s_m * (body - v), v)
        return within_damping(wish, v, low_n_s_m, high_n_s_m)

    return force


def _groundhook(values: Mapping[str, ParameterValue]) -> ForceLaw:
    return _mix(0.0, number(values, GROUND.name), *damping_bounds(values))


def _hybrid(values: Mapping[str, ParameterValue]) -> ForceLaw:
    share = number(values, SHARE.name)
    return _mix(
        share * number(values, SKY.name),
        (1.0 - share) * number(values, GROUND.name),
        *damping_bounds(values),
    )


GROUNDHOOK = Law(
    name="groundhook",
    summary="damps the wheel against the ground: tyre load before comfort",
    source="Valasek, Novak, Sika, Vaculin: Extended ground-hook, 1997",
    parameters=(GROUND, MINIMUM, MAXIMUM),
    needs=frozenset({"body_velocity"}),
    make=_groundhook,
)

HYBRID = Law(
    name="hybrid",
    summary="a weighted sum of skyhook and groundhook",
    source="Goncalves, Ahmadian: A hybrid control policy for semi-active vehicle suspensions, 2003",
    parameters=(SHARE, SKY, GROUND, MINIMUM, MAXIMUM),
    needs=frozenset({"body_velocity"}),
    make=_hybrid,
)
