"""Self-heating: the fluid is hotter than the case that is measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector
from mrctl.model.static import StaticTables, backbone_force

LEAST_K_J = 1e-6  # a heat capacity of 1 MJ/K
FASTEST_S = 2.0  # of a fluid's cooling: what goes faster, or would, is no warmth
RISE_AT_START = Parameter(
    "rise_at_start_k", "K", 0.0, -20.0, 100.0, 0.0, "fluid above case when a run begins", 5.0
)


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    temperature_c: float,
    velocity_m_s: float,
    current_a: float,
    tables: StaticTables,
    dt_s: float,
) -> float:
    """The fluid's temperature in degC; exact for a power that is constant over the sample."""
    fluid_c = temperature_c + s[0]
    if p[0] > 0.0:
        power_w = backbone_force(velocity_m_s, current_a, fluid_c, tables) * velocity_m_s
        power_w += p[2] * current_a * current_a
        settled_k = p[0] * power_w * p[1]
        s[0] = settled_k + (s[0] - settled_k) * math.exp(-dt_s / p[1])
    return fluid_c


def start(
    p: Sequence[float],
    temperature_c: float,  # noqa: ARG001 - the stage's
    velocity_m_s: float,  # noqa: ARG001 - the stage's
    current_a: float,  # noqa: ARG001 - the stage's
    tables: StaticTables,  # noqa: ARG001 - the stage's
    dt_s: float,  # noqa: ARG001 - the stage's
) -> list[float]:
    """The run begins with the fluid warmer than the case by the stated rise, whatever the first sample."""
    return [p[3]]


def _guesses(ranges: Ranges) -> list[Vector]:
    return [(1e-4, 200.0, 2.0, 0.0), *_far(ranges), (2e-2, 8.0, 2.0, 0.0)]


def _far(_: Ranges) -> list[Vector]:
    return [(1e-3, 200.0, 2.0, 0.0), (5e-3, 70.0, 2.0, 0.0)]


def _plausible(p: Vector, _: Ranges) -> bool:
    """Something heats, and stays warm: a rise at the start alone is an error of the case's temperature."""
    return p[0] > LEAST_K_J and p[1] > 1.001 * FASTEST_S


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    if p[0] <= 0.0:
        return {}
    return {"heat capacity": (1.0 / p[0], "J/K"), "heat transfer": (1.0 / (p[0] * p[1]), "W/K")}


EFFECT = Effect(
    name="self_heating",
    stage=Stage.TEMPERATURE,
    summary="Damping and the coil heat the fluid above the case, over minutes, and warm fluid damps less.",
    equation="drise/dt = heating (F v + resistance i1^2) - rise / cooling_time, T1 = T + rise, F = f g h",
    source=(
        "Lumped energy balance C dTf/dt = F v + R i^2 - G (Tf - Tc) with heating 1/C and cooling time C/G; "
        "Gordaninejad, Breese, J. Intell. Mater. Syst. Struct. 10 (1999). "
        "F is the static force: what H stores and the forces beside it add averages out."
    ),
    parameters=(
        Parameter("heating_k_j", "K/J", 0.0, 0.0, 0.3, 1e-3, "one over the heat capacity of the fluid"),
        Parameter(
            "cooling_time_s",
            "s",
            200.0,
            FASTEST_S,
            2e4,
            200.0,
            "time constant of fluid against case",
            endless=True,
        ),
        Parameter("resistance_ohm", "ohm", 2.0, 0.0, 20.0, 2.0, "resistance of the coil", held=True),
        RISE_AT_START,
    ),
    step=step,
    shape_over=frozenset({"energy", "temperature", "time"}),
    inverse=Undo.OBSERVE,
    inverse_note="The fluid's temperature is followed with the currents commanded; h is taken there.",
    start=start,
    states=("fluid above case, K",),
    guesses=_guesses,
    far=_far,
    derived=_derived,
    plausible=_plausible,
)
