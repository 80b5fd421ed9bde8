"""Magnetic hysteresis: the field remembers whether the current came from above or from below."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Stage, Undo, Vector


def step(p: Sequence[float], s: MutableSequence[float], current_a: float, dt_s: float) -> float:
    """The current in A that would make the same field without hysteresis."""
    reach = p[0] / p[1]
    s[0] = max(current_a - reach, min(current_a + reach, s[0]))
    return current_a + p[1] * (s[0] - current_a)


def start(p: Sequence[float], current_a: float, dt_s: float) -> list[float]:
    """The current was reached from 0 A."""
    return [max(0.0, current_a - p[0] / p[1])]


def undo(p: Sequence[float], s: MutableSequence[float], wanted_a: float, dt_s: float) -> float:
    """The current in A whose field is the wanted one: the play is crossed at once."""
    reach = p[0] / p[1]
    if wanted_a + p[0] >= s[0] + reach:
        return wanted_a + p[0]
    if wanted_a - p[0] <= s[0] - reach:
        return wanted_a - p[0]
    return s[0] + (wanted_a - s[0]) / (1.0 - p[1])  # within the play, so the share is below 1


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    return {"play's half width": (p[0] / p[1], "A")}


EFFECT = Effect(
    name="magnetic_hysteresis",
    stage=Stage.CURRENT,
    summary="The field lags behind a rising and a falling current by the same amount, however slow it is.",
    equation="i1 = i + share (y - i), y = play of i with half width half_width / share",
    source="Play operator: Krasnosel'skii, Pokrovskii 1989. In MR: An, Kwon, JIMSS 14 (2003).",
    parameters=(
        Parameter("half_width_a", "A", 0.0, 0.0, 0.5, 0.08, "half the width of the loop of i1 over i"),
        Parameter(
            "share", "1", 1.0, 0.1, 1.0, 1.0, "share of the field that is subject to the play", 0.2, held=True
        ),
    ),
    step=step,
    inverse=Undo.LEAD,
    inverse_note=(
        "The play is followed in the model; the command jumps across it when the wish turns round, "
        "so that noise in the wish comes out as steps of the loop's width."
    ),
    start=start,
    states=("output of the play, A",),
    undo=undo,
    derived=_derived,
    rank=1,
)
