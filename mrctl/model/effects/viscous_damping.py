"""Viscous damping that the current does not scale: the plain oil behind the magnetic fluid."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import FORCE_LAG, Effect, Parameter, Ranges, Stage, Undo, Vector
from mrctl.model.lag import lagged

USUAL_THINNING = 0.015
REFERENCE_C = 40.0  # the temperature at which viscosity grades are stated (ISO 3448)
USUAL_EASING = 0.005  # between a silicone's (Arrhenius, 1/313 K) and a mineral oil's (1/135 K)
LEAST_EASED = 0.1  # far colder than oil flows


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
    """The viscous force in N."""
    s[0] = lagged(_steady(p, velocity_m_s, temperature_c), s[0], p[2], dt_s)
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
    return [_steady(p, velocity_m_s, temperature_c)]


def _steady(p: Sequence[float], velocity_m_s: float, temperature_c: float) -> float:
    warmer_k = temperature_c - REFERENCE_C
    eased = max(1.0 + p[3] * warmer_k, LEAST_EASED)
    return p[0] * math.exp(-p[1] * warmer_k / eased) * velocity_m_s


def _guesses(_: Ranges) -> list[Vector]:
    return [(400.0, USUAL_THINNING, lag_s, USUAL_EASING) for lag_s in (0.0, 6e-3)]


EFFECT = Effect(
    name="viscous_damping",
    stage=Stage.ADDITIVE,
    summary="Plain viscosity, not scaled by the current, and thinner when warm.",
    equation="lag dF/dt + F = damping exp(-thinning w / (1 + easing w)) v, w = T - 40 degC",
    source=(
        "Bingham damper's viscous part (Stanway 1987) with Vogel's viscosity law, exp(b / (T + c)): an "
        "easing of 1/135 K is Cameron's c of 95 K for mineral oils, 1/313 K Arrhenius' law, 0 Reynolds' "
        "exponential. The fluid is as compliant here as where it yields, so that this force may lag as that "
        "behind H does."
    ),
    parameters=(
        Parameter("damping_n_s_m", "N*s/m", 0.0, 0.0, 5e4, 400.0, "damping at 40 degC", linear=True),
        Parameter(
            "thinning_per_k",
            "1/K",
            USUAL_THINNING,  # of what no data decide, an oil's is nearer than none
            0.0,
            0.06,
            USUAL_THINNING,
            "relative loss of viscosity a kelvin, at 40 degC",
            0.01,
            optional=True,  # at one temperature it does what the damping does
        ),
        FORCE_LAG,
        Parameter(
            "easing_per_k",
            "1/K",
            0.0,  # which one without it meant
            0.0,
            0.0085,
            0.0,
            "relative ease of that loss a kelvin: the colder, the more is lost",
            0.003,
            optional=True,
        ),
    ),
    step=step,
    start=start,
    states=("force, N",),
    guesses=_guesses,
    shape_over=frozenset({"temperature", "velocity"}),
    inverse=Undo.SUBTRACT,
    inverse_note="Its force at the measured velocity and temperature is taken off the wish.",
)
