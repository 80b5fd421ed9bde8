"""Quadratic damping: turbulent flow through orifices, not scaled by the current."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

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
    """The orifice force in N."""
    s[0] = lagged(_steady(p, velocity_m_s), s[0], p[1], dt_s)
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
    return [_steady(p, velocity_m_s)]


def _steady(p: Sequence[float], velocity_m_s: float) -> float:
    if velocity_m_s >= 0.0:
        return p[0] * velocity_m_s * velocity_m_s
    return -p[0] * (1.0 + p[2]) * velocity_m_s * velocity_m_s


def _guesses(ranges: Ranges) -> list[Vector]:
    coefficient = 0.05 * ranges.force_n / max(ranges.velocity_m_s, 0.01) ** 2
    return [(coefficient, 0.0, 0.0), (coefficient, 6e-3, 0.0)]


EFFECT = Effect(
    name="quadratic_damping",
    stage=Stage.ADDITIVE,
    summary="Turbulent flow through an orifice: force with the square of velocity, whatever the current.",
    equation=(
        "lag dF/dt + F = coefficient v |v| in rebound (v >= 0), "
        "coefficient (1 + change) v |v| in compression (v < 0)"
    ),
    source=(
        "Orifice law dp = rho Q^2 / (2 Cd^2 A^2); Dixon, The Shock Absorber Handbook, 2nd ed. The chamber's "
        "compliance may make it lag as the force behind H does; valves may open other orifices for either "
        "direction."
    ),
    parameters=(
        Parameter("coefficient_n_s2_m2", "N*s^2/m^2", 0.0, 0.0, 1e5, 400.0, "force at 1 m/s", linear=True),
        FORCE_LAG,
        COMPRESSION_CHANGE,
    ),
    step=step,
    start=start,
    states=("force, N",),
    shape_over=frozenset({"temperature", "velocity"}),
    inverse=Undo.SUBTRACT,
    inverse_note="Its force at the measured velocity is taken off the wish.",
    guesses=_guesses,
)
