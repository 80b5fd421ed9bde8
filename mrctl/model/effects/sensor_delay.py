"""Sensor delay: the measured force comes later than the measured motion."""

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector


def step(p: Sequence[float], s: MutableSequence[float], force_n: float, dt_s: float) -> float:
    """The force in N a delay ago: the cubic through the four samples around that instant."""
    size = len(s) - 1
    newest = (int(s[0]) + 1) % size
    s[0] = newest
    s[1 + newest] = force_n
    back = p[0] / dt_s
    first = min(max(int(back) - 1, 0), size - 4)
    u = back - first
    f0 = s[1 + (newest - first) % size]
    f1 = s[1 + (newest - first - 1) % size]
    f2 = s[1 + (newest - first - 2) % size]
    f3 = s[1 + (newest - first - 3) % size]
    return (
        f0 * ((1.0 - u) * (2.0 - u) * (3.0 - u) / 6.0)
        + f1 * (u * (2.0 - u) * (3.0 - u) / 2.0)
        + f2 * (u * (u - 1.0) * (3.0 - u) / 2.0)
        + f3 * (u * (u - 1.0) * (u - 2.0) / 6.0)
    )


def start(p: Sequence[float], force_n: float, dt_s: float) -> list[float]:
    """The first force has lasted for ever."""
    return [0.0] + [force_n] * (math.ceil(p[0] / dt_s) + 4)


def _plausible(p: Vector, ranges: Ranges) -> bool:
    """More than what reading between samples may get wrong."""
    return p[0] > 0.1 * ranges.sample_s


EFFECT = Effect(
    name="sensor_delay",
    stage=Stage.OUTPUT,
    summary="The force channel comes late against the velocity channel: filters, multiplexers, telegrams.",
    equation="F(t) = F0(t - delay)",
    source="Fractional delay, cubic Lagrange: Laakso et al., IEEE Signal Process. Mag. 13 (1996).",
    parameters=(Parameter("delay_s", "s", 0.0, 0.0, 0.02, 2e-3, "how much later the force is measured"),),
    step=step,
    inverse=Undo.NOT_UNDONE,
    inverse_note=(
        "The damper itself is not late, its measurement is: against the force sensor "
        "the wish appears to be met late by the delay."
    ),
    start=start,
    states=("place in the ring", "the last forces, N"),
    plausible=_plausible,
    linear=True,
)
