"""Liu's temperature-corrected skyhook (Eq. 2.1): no field is asked for where the fluid alone is enough."""

from __future__ import annotations

from collections.abc import Mapping

from mrctl.control.base import ForceLaw, Law, Motion, Parameter, ParameterValue
from mrctl.control.parameters import number
from mrctl.control.skyhook import SKY
from mrctl.model.baselines.liu import viscosity_pa_s

VISCOUS_LENGTH = Parameter(
    "viscous_length_m",
    "m",
    9000.0,
    0.0,
    1.0e6,
    "k of Eq. 2.2: viscous damping over viscosity, the same as of Liu's current map",
)


def _liu(values: Mapping[str, ParameterValue]) -> ForceLaw:
    sky, length = number(values, SKY.name), number(values, VISCOUS_LENGTH.name)

    def force(motion: Motion) -> float:
        v, body = motion.relative_velocity_m_s, motion.body_velocity_m_s
        viscous = length * viscosity_pa_s(motion.temperature_c)
        if body * v > 0.0 and sky * abs(body) > viscous * abs(v):
            return sky * body
        return viscous * v

    return force


LIU = Law(
    name="liu",
    summary="skyhook where that is more than the fluid's viscous force at this temperature, else that force",
    source="paper Eq. 2.1 and 2.3",
    parameters=(SKY, VISCOUS_LENGTH),
    needs=frozenset({"body_velocity", "temperature"}),
    make=_liu,
    continuous=False,
)
