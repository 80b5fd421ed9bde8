"""Magnetic hysteresis: the field remembers whether the current came from above or from below."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

# Fields nearer than this are one: rounding alone must not send the command across the loop.
SAME_A = 1e-9
NEWTON_ROUNDS = 4  # from where they begin, to the last digits


def step(p: Sequence[float], s: MutableSequence[float], current_a: float, dt_s: float) -> float:
    """The current in A that would make the same field without hysteresis.

    Exact for a current that does not turn round between samples, however far apart they are.
    """
    if p[0] <= 0.0:
        return current_a
    move = current_a - s[2]
    s[0] = max(-p[0], min(p[0], s[0] + p[1] * move))
    s[1] += (s[1] - math.copysign(p[0], move)) * math.expm1(-0.5 * p[1] * abs(move) / p[0])
    s[2] = current_a
    return current_a - _behind(p, s)


def _behind(p: Sequence[float], s: Sequence[float]) -> float:
    """How far in A the field is behind the last current."""
    return (1.0 - p[2]) * s[0] + p[2] * s[1]


def start(p: Sequence[float], current_a: float, dt_s: float) -> list[float]:
    """The current was reached from 0 A, demagnetised."""
    state = [0.0, 0.0, 0.0]
    step(p, state, current_a, dt_s)
    return state


def undo(p: Sequence[float], s: MutableSequence[float], wanted_a: float, dt_s: float) -> float:
    """The current in A whose field is the wanted one; exact, play being crossed at once."""
    if p[0] <= SAME_A:
        return wanted_a
    missing = wanted_a - (s[2] - _behind(p, s))
    if abs(missing) <= SAME_A:
        return s[2]
    if missing > 0.0:
        return s[2] + _way(p, s[0], s[1], missing)
    return s[2] - _way(p, -s[0], -s[1], -missing)


def _way(p: Sequence[float], play_a: float, bend_a: float, missing_a: float) -> float:
    """The rise in A of the current that makes the field rise by missing_a; a fall is its mirror image."""
    rate = 0.5 * p[1] / p[0]
    bent = p[2] * (p[0] - bend_a)
    play = (1.0 - p[2]) * (p[0] - play_a)
    firm = 1.0 - (1.0 - p[2]) * p[1]  # slope of the field but for the bend, until the play is crossed
    corner = (p[0] - play_a) / p[1]
    if missing_a < firm * corner + bent * math.expm1(-rate * corner):
        return _root(bent * rate / firm, missing_a * rate / firm) / rate
    return _root(bent * rate, (missing_a + play) * rate) / rate


def _root(k: float, q: float) -> float:
    """The x > 0 for which x - k (1 - exp(-x)) = q > 0, k within 0 and 1."""
    # 1 - exp(-x) <= 2x / (2 + x), and <= 1: the root of either bound is above x, and the left side is
    # convex, so that Newton's steps come down to x from there.
    b = 2.0 - 2.0 * k - q
    size = math.sqrt(b * b + 8.0 * q)
    x = min(4.0 * q / (size + b) if b > 0.0 else 0.5 * (size - b), q + k)
    for _ in range(NEWTON_ROUNDS):
        fade = k * math.expm1(-x)
        x -= (x + fade - q) / (1.0 - k - fade)
    return x


def _guesses(_: Ranges) -> list[Vector]:
    return [(0.08, 1.0, 0.0), (0.08, 0.6, 1.0), (0.15, 0.4, 1.0)]


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    if p[0] <= 0.0 or p[1] <= 0.0:
        return {}
    return {"change of current that turns it round": (2.0 * p[0] / p[1], "A")}


EFFECT = Effect(
    name="magnetic_hysteresis",
    stage=Stage.CURRENT,
    summary="The field lags behind a rising and a falling current by the same amount, however slow it is.",
    equation=(
        "i1 = i - (1 - smoothness) y - smoothness z, both within +-half_width; dy/di = share up to there, "
        "dz/di = share/2 (1 - sign(di) z/half_width)"
    ),
    source=(
        "y: play operator, Krasnosel'skii, Pokrovskii 1989. z: Duhem's form of Coleman, Hodgdon, Int. J. "
        "Eng. Sci. 24 (1986), with f(i) = i, g = 1 - share/2, alpha = share/(2 half_width); near "
        "the loops of Jiles, Atherton, J. Magn. Magn. Mater. 61 (1986). In MR: An, Kwon, JIMSS 14 (2003)."
    ),
    parameters=(
        Parameter("half_width_a", "A", 0.0, 0.0, 0.5, 0.08, "half the width of the loop of i1 over i"),
        Parameter(
            "share",
            "1",
            1.0,
            0.1,
            1.0,
            1.0,
            "slope of i - i1 over i as the loop turns round",
            0.2,
            optional=True,
        ),
        Parameter(
            "smoothness", "1", 0.0, 0.0, 1.0, 0.0, "sharp corners (play) 0, smooth loop 1", 0.3, optional=True
        ),
    ),
    step=step,
    shape_over=frozenset({"current", "current rate"}),
    inverse=Undo.LEAD,
    inverse_note=(
        "The loop is followed in the model; the command crosses it when the wish turns round, at once where "
        "share is 1 and smoothness 0, so that noise in the wish comes out as steps of the loop's width."
    ),
    start=start,
    states=("deviation with play, A", "smooth deviation, A", "last current, A"),
    undo=undo,
    guesses=_guesses,
    derived=_derived,
    rank=1,
)
