"""Preyield stiffness: the fluid stretches elastically before it yields."""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

# A force that has to be divided by its elastic share grows at most this much.
LARGEST_GAIN = 5.0
# Below this part of the shape the fluid creeps at a rate that no longer rises.
SMALLEST_SHAPE = 1e-3


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    force_n: float,
    velocity_m_s: float,
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,
    dt_s: float,
) -> float:
    """The force in N; exact for a shape that runs straight over the sample's displacement."""
    length = p[0] + p[1] * level_n
    if length <= 0.0:
        return force_n
    shape = force_n / level_n
    way = abs(velocity_m_s) * dt_s / (length * max(abs(shape), SMALLEST_SHAPE) ** p[2])
    decay = math.exp(-way)
    mean = (1.0 - decay) / way if way > 1e-6 else 1.0 - 0.5 * way
    elastic: float = shape - (shape - s[1]) * mean + (s[0] - s[1]) * decay
    s[0] = elastic
    s[1] = shape
    return elastic * level_n


def start(
    p: Sequence[float],  # noqa: ARG001 - the stage's
    force_n: float,
    velocity_m_s: float,  # noqa: ARG001 - the stage's
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,
    dt_s: float,  # noqa: ARG001 - the stage's
) -> list[float]:
    """Yielded: the force is the static one."""
    return [force_n / level_n, force_n / level_n]


def undo(
    p: Sequence[float],
    s: MutableSequence[float],
    wanted_n: float,
    velocity_m_s: float,
    displacement_m: float,  # noqa: ARG001 - the stage's
    level_n: float,
    dt_s: float,
) -> float:
    """The static force in N whose current makes the wanted force with the elastic shape of this moment."""
    length = p[0] + p[1] * level_n
    if length <= 0.0:
        return wanted_n
    shape = s[1]  # of the sample before: this one's is what the current is sought for
    way = abs(velocity_m_s) * dt_s / (length * max(abs(shape), SMALLEST_SHAPE) ** p[2])
    elastic = shape + (s[0] - shape) * math.exp(-way)
    if abs(shape) >= LARGEST_GAIN * abs(elastic):
        return wanted_n * math.copysign(LARGEST_GAIN, shape * elastic)
    return wanted_n * shape / elastic


def _guesses(_: Ranges) -> list[Vector]:
    return [(5e-4, 0.0, 0.0), (5e-4, 0.0, 1.0)]


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    length = p[0] + 1e3 * p[1]
    return {"stiffness at f h = 1 kN": (1e3 / length, "N/m")} if length > 0.0 else {}


EFFECT = Effect(
    name="preyield_stiffness",
    stage=Stage.YIELD,
    summary="After a reversal the force turns round over a length, not at once: the fluid is elastic first.",
    equation="F = f h z, dz/dt = |v| (g - z) / (|g|^creep length), length = yield_length + compliance f h",
    source=(
        "Dahl, AIAA Journal 14 (1976); for MR dampers Ikhouane, Dyke, Smart Mater. Struct. 16 (2007). "
        "creep 0: Dahl, turning round over a length; 1: Maxwell, a spring in series with the fluid, whose "
        "flow at z is taken along the chord of g. "
        "yield_length: the same strain at all currents, as in Bouc-Wen; compliance: the same stiffness."
    ),
    parameters=(
        Parameter("yield_length_m", "m", 0.0, 0.0, 0.02, 5e-4, "length over which the shape turns round"),
        Parameter(
            "compliance_m_n", "m/N", 0.0, 0.0, 2e-5, 0.0, "length that each newton of f h adds to it", 2e-7
        ),
        Parameter("creep", "1", 0.0, 0.0, 1.0, 0.0, "how far slow flow relaxes it: Dahl 0, Maxwell 1", 0.3),
    ),
    step=step,
    inverse=Undo.DIVIDE,
    inverse_note=(
        "The elastic shape z is followed in the model, and the current is sought for the force over z in "
        f"place of g, up to {LARGEST_GAIN:g} times; where z passes through 0 no current makes a force."
    ),
    start=start,
    states=("elastic shape z, -1 to 1", "shape g of the sample before"),
    undo=undo,
    guesses=_guesses,
    derived=_derived,
)
