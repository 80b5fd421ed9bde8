"""What a semi-active damper can be asked for: forces that dissipate, between two damping lines.

Shared by the hook family, and the parameters that they have in common.
"""

from __future__ import annotations

from collections.abc import Mapping

from mrctl.control.base import Parameter, ParameterValue
from mrctl.control.parameters import number

DAMPING_BOUND_N_S_M = 1.0e6

MINIMUM = Parameter(
    "minimum_n_s_m",
    "N s/m",
    300.0,
    0.0,
    DAMPING_BOUND_N_S_M,
    "damping that is asked for at least, also where the law wants none",
)
MAXIMUM = Parameter(
    "maximum_n_s_m",
    "N s/m",
    20000.0,
    0.0,
    DAMPING_BOUND_N_S_M,
    "damping that is asked for at most; makes the wish go to 0 with the relative velocity",
)


def damping_bounds(values: Mapping[str, ParameterValue]) -> tuple[float, float]:
    """The smallest and largest damping in N s/m. Raises ValueError when they are the wrong way round."""
    low, high = number(values, MINIMUM.name), number(values, MAXIMUM.name)
    if low > high:
        raise ValueError(
            f"{MINIMUM.name} {low:g} is above {MAXIMUM.name} {high:g}; swap them or raise {MAXIMUM.name}"
        )
    return low, high


def dissipative_part(force_n: float, relative_velocity_m_s: float) -> float:
    """The force where it resists the relative motion, 0 where it would drive it."""
    return force_n if force_n * relative_velocity_m_s > 0.0 else 0.0


def within_damping(
    force_n: float, relative_velocity_m_s: float, low_n_s_m: float, high_n_s_m: float
) -> float:
    """The force brought between two damping lines through the origin.

    Continuous in the force and in the velocity: at no velocity both lines meet in 0.
    """
    slow, fast = low_n_s_m * relative_velocity_m_s, high_n_s_m * relative_velocity_m_s
    if relative_velocity_m_s < 0.0:
        slow, fast = fast, slow
    if force_n < slow:
        return slow
    return fast if force_n > fast else force_n  # noqa: FURB136  # min() takes three times as long, hot
