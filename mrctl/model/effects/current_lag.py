"""Current lag: coil inductance and eddy currents delay the field behind the command."""

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

# The lead asks the driver for at most this many times the missing current; noise grows as much.
LARGEST_LEAD = 5.0


def _time_constant(p: Sequence[float], wanted_a: float, current_a: float) -> float:
    return (p[0] if wanted_a >= current_a else p[1]) / (1.0 + p[2] * abs(current_a))


def step(p: Sequence[float], s: MutableSequence[float], current_a: float, dt_s: float) -> float:
    """The current in A that makes the field; exact for a command that runs straight between samples."""
    tau = _time_constant(p, current_a, s[0])
    if tau <= 0.0:
        field_a = current_a
    else:
        decay = math.exp(-dt_s / tau)
        rise = (current_a - s[1]) * tau / dt_s
        field_a = current_a - rise * (1.0 - decay) + (s[0] - s[1]) * decay
    s[0] = field_a
    s[1] = current_a
    return field_a


def held(p: Sequence[float], s: MutableSequence[float], current_a: float, dt_s: float) -> float:
    """The current in A after a sample through which a driver held the command, as `undo` takes it to."""
    tau = _time_constant(p, current_a, s[0])
    decay = math.exp(-dt_s / tau) if tau > 0.0 else 0.0
    s[0] = current_a + (s[0] - current_a) * decay
    s[1] = current_a
    return s[0]


def start(p: Sequence[float], current_a: float, dt_s: float) -> list[float]:  # noqa: ARG001 - the stage's
    """The command has lasted for ever."""
    return [current_a, current_a]


def undo(p: Sequence[float], s: MutableSequence[float], wanted_a: float, dt_s: float) -> float:
    """The command in A that brings the field to the wanted value as fast as the largest lead allows."""
    tau = _time_constant(p, wanted_a, s[0])
    if tau <= 0.0:
        return wanted_a
    return s[0] + (wanted_a - s[0]) * min(1.0 / (1.0 - math.exp(-dt_s / tau)), LARGEST_LEAD)


def _plausible(p: Vector, ranges: Ranges) -> bool:
    """Longer than what nobody knows of the time of a step that fell between two samples."""
    return max(p[0], p[1]) > 0.5 * ranges.sample_s


EFFECT = Effect(
    name="current_lag",
    stage=Stage.CURRENT,
    summary="The field follows the command late: coil L/R and eddy currents, other up than down.",
    equation=(
        "tau di1/dt + i1 = i, tau (1 + saturation |i1|) = rise time where i > i1, fall time where i < i1"
    ),
    source=(
        "Response times of MR dampers: Koo, Goncalves, Ahmadian, Smart Mater. Struct. 15 (2006). "
        "A coil's inductance falls as its iron saturates."
    ),
    parameters=(
        Parameter("rise_time_s", "s", 0.0, 0.0, 0.2, 0.010, "time constant while the current rises"),
        Parameter("fall_time_s", "s", 0.0, 0.0, 0.2, 0.010, "time constant while the current falls"),
        Parameter(
            "saturation_per_a",
            "1/A",
            0.0,
            0.0,
            10.0,
            0.0,
            "how soon both shorten with the current",
            0.3,
            optional=True,
        ),
    ),
    step=step,
    shape_over=frozenset({"current", "current rate"}),
    inverse=Undo.LEAD,
    inverse_note=(
        "The coil's current is followed in the model and the command overshoots it by up to "
        f"{LARGEST_LEAD:g} times what is missing, within the range and slew limit of the driver."
    ),
    start=start,
    states=("current in the coil, A", "last command, A"),
    undo=undo,
    held=held,
    plausible=_plausible,
)
