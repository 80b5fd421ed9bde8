"""What a control law is: parameters with units and bounds, what it needs to know, and a pure function."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

ParameterValue = float | Sequence[float]


@dataclass(slots=True)
class Motion:
    """What is known of one corner at one tick.

    Relative velocity > 0 is extension; body velocity > 0 is upward; forces > 0 resist extension.
    What the configuration does not bring in is 0. A corner fills in the same one tick after tick: a law
    must not keep it.
    """

    relative_velocity_m_s: float
    body_velocity_m_s: float
    temperature_c: float
    displacement_m: float = 0.0
    force_wish_n: float = 0.0


# From motion to desired damper force in N.
ForceLaw = Callable[[Motion], float]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a law or a current map: a number, or a table column of numbers."""

    name: str
    unit: str
    default: ParameterValue
    low: float
    high: float
    help: str


@dataclass(frozen=True, slots=True)
class Law:
    """A control law: its name, one line on what it does, its source, parameters and required signals."""

    name: str
    summary: str
    source: str
    parameters: tuple[Parameter, ...]
    needs: frozenset[str]  # beside relative velocity: body_velocity, temperature, displacement, force_wish
    make: Callable[[Mapping[str, ParameterValue]], ForceLaw]
    dissipative: bool = True  # never asks for a force that would drive the relative motion
    continuous: bool = True  # no jump of the force at any sign change of a velocity
