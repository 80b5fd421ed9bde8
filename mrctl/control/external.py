"""A force wish that another controller sends."""

from __future__ import annotations

from collections.abc import Mapping

from mrctl.control.base import ForceLaw, Law, Motion, Parameter, ParameterValue
from mrctl.control.parameters import number

LIMIT = Parameter("limit_n", "N", 1.0e4, 0.0, 1.0e5, "largest force that is passed on, either way")


def _external(values: Mapping[str, ParameterValue]) -> ForceLaw:
    limit = number(values, LIMIT.name)

    def force(motion: Motion) -> float:
        return min(max(motion.force_wish_n, -limit), limit)

    return force


EXTERNAL = Law(
    name="external",
    summary="the force wish that comes in from the bus, within a limit",
    source="another controller",
    parameters=(LIMIT,),
    needs=frozenset({"force_wish"}),
    make=_external,
    dissipative=False,
)
