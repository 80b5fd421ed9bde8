"""Cavitation: in compression the gas pressure cannot push more fluid through, and the force stops growing."""

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence

from mrctl.model.effects.base import (
    FORCE_LAG,
    FORCE_SWING,
    Effect,
    Parameter,
    Ranges,
    Stage,
    Undo,
    Vector,
)
from mrctl.model.lag import swung
from mrctl.model.static import StaticTables, compression_speed

NO_LIMIT_N = 1e6
NO_MOST_M = 0.1  # a cavity as long as a damper has no largest size
LEAST_SHARE = 0.1  # of the limit, however far the rod is out
REFERENCE_C = 25.0  # at which the limit is stated
LESS = 0.9  # of the largest force, that the largest in compression is where it is limited
LEAST_N = 1e-3  # of f h, to divide by
LAG = 9  # its place among the parameters
MOST_M = (5e-4, 2e-3)  # at which a cavity may be full, to begin with
SOFTEST = 0.5  # of the limit, that the force at the limit falls short of it


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    force_n: float,
    velocity_m_s: float,
    displacement_m: float,
    temperature_c: float,
    static_n: float,
    level_n: float,
    tables: StaticTables,
    dt_s: float,
) -> float:
    """The force in N: in compression bent towards the limit, or held at it by an open cavity.

    What is taken off it comes late where the fluid's own force does. The gas that holds it up has a higher
    pressure when it is warm, and the further the rod is in.
    """
    warmer = 1.0 + p[6] * (temperature_c - REFERENCE_C)
    limit_n = p[0] * max((1.0 - p[4] * displacement_m) * warmer, LEAST_SHARE)
    taken_n = 0.0
    if p[7] > 0.0:
        taken_n += p[7] * _held(p, s, limit_n, velocity_m_s, static_n, level_n, tables, dt_s)
    if p[7] < 1.0:
        taken_n += (1.0 - p[7]) * (
            _bent(p, s, limit_n, force_n, velocity_m_s, level_n, tables, dt_s) - force_n
        )
    lagged_n = swung(taken_n, s[2], s[3], p[9], p[10], dt_s)
    s[2], s[3] = lagged_n, s[2]
    return force_n + lagged_n


def _bent(
    p: Sequence[float],
    s: MutableSequence[float],
    limit_n: float,
    force_n: float,
    velocity_m_s: float,
    level_n: float,
    tables: StaticTables,
    dt_s: float,
) -> float:
    """The force in N nears the limit, but does not reach it.

    What fluid does not follow opens a cavity, by the share of the force that is missing or by the flow that
    is, which fills it again as the piston slows down; the way back must close it first, but for what other
    flow has filled meanwhile; where another valve leads to it, it closes the faster. It costs rebound force:
    one that still pushes as the piston turns, since it comes late, is none yet, but may be lost too.
    """
    opens = 0.0
    if force_n < 0.0:
        sharpness = math.log(0.5) / math.log1p(-min(p[1] / p[0], SOFTEST))
        share, most = -force_n / limit_n, 1.0
        if share > 1.0:  # no power of what is above 1: it may be beyond all numbers
            share, most = 1.0 / share, 1.0 / share
        most /= math.pow(1.0 + math.pow(share, sharpness), 1.0 / sharpness)
        force_n *= most
        opens = abs(velocity_m_s) * (1.0 - most)
        if p[14] > 0.0:
            flow = 0.0
            if velocity_m_s < 0.0:
                flow = -velocity_m_s - compression_speed(limit_n / max(level_n, LEAST_N), tables)
            opens += p[14] * (flow - opens)
        opens *= 1.0 - p[5]
    if velocity_m_s > 0.0:  # an empty one stays empty, but what hangs on that must not jump as it fills
        opens -= velocity_m_s + p[8]
    before_m, after_m = s[0], _filled(s[0], s[4], opens, p[15], dt_s)
    s[0] = max(after_m, 0.0) * math.exp(-p[13] * dt_s)
    s[4] = opens
    if velocity_m_s > 0.0:
        lost = p[2] if force_n > 0.0 else p[16] * p[2]
        force_n *= 1.0 - lost * _open(before_m, after_m, p[3])
    return force_n


def _filled(cavity_m: float, before_m_s: float, opens_m_s: float, most_m: float, dt_s: float) -> float:
    """A cavity after a sample over which the speed at which it opens runs straight: below 0, it closed."""
    after_m = cavity_m + 0.5 * (before_m_s + opens_m_s) * dt_s
    if before_m_s < 0.0 < opens_m_s:  # no less than what opens once it turned
        after_m = max(after_m, 0.5 * opens_m_s * opens_m_s / (opens_m_s - before_m_s) * dt_s)
    return min(after_m, most_m)


def _open(before_m: float, after_m: float, closing_m: float) -> float:
    """The mean of y/(y + closing) over a sample, of which a cavity that closes is open for a part only."""
    last_m, part = max(after_m, 0.0), 1.0
    if after_m < 0.0:
        part = before_m / (before_m - after_m)
    grown_m = last_m - before_m
    if abs(grown_m) < 1e-3 * (before_m + closing_m):
        mean_m = 0.5 * (before_m + last_m)
        return part * mean_m / (mean_m + closing_m)
    return part * (1.0 - closing_m / grown_m * math.log((last_m + closing_m) / (before_m + closing_m)))


def _held(
    p: Sequence[float],
    s: MutableSequence[float],
    limit_n: float,
    velocity_m_s: float,
    static_n: float,
    level_n: float,
    tables: StaticTables,
    dt_s: float,
) -> float:
    """What is taken off the force in N while a cavity is open.

    Vapour on one side and the gas on the other press as at the limit, and fluid follows as fast as it does
    at that force, whatever the piston does; or the gas presses less as the piston comes back, for fluid
    from elsewhere fills the cavity.
    """
    limit_n *= 1.0 + p[11] * s[1]
    if velocity_m_s > 0.0:
        limit_n *= 1.0 - p[12]
    follows = compression_speed(limit_n / max(level_n, LEAST_N), tables)
    opens = -velocity_m_s - follows
    before_m, before_leak_m = s[1], s[6]
    if opens > 0.0:
        opens *= 1.0 - p[5]
        s[6] += p[8] * dt_s  # what flows in as it opens keeps it small, but lifts no pressure
    else:
        s[6] = 0.0
    opens -= p[8]
    after_m = _filled(s[1], s[5], opens, p[15], dt_s)
    s[1] = max(after_m, 0.0) * math.exp(-p[13] * dt_s)
    s[5] = opens
    opened = _open(before_m + before_leak_m * (s[6] > 0.0), after_m + s[6], p[3])
    return -opened * (limit_n + static_n)


def start(
    p: Sequence[float],
    force_n: float,
    velocity_m_s: float,
    displacement_m: float,
    temperature_c: float,
    static_n: float,
    level_n: float,
    tables: StaticTables,
    dt_s: float,
) -> list[float]:
    """No cavity yet."""
    at_once, state = (*p[:LAG], 0.0, 0.0, *p[LAG + 2 :]), [0.0] * 7
    now = velocity_m_s, displacement_m, temperature_c, static_n, level_n, tables, dt_s
    taken_n = step(at_once, state, force_n, *now) - force_n
    return [0.0, 0.0, taken_n, taken_n, *state[4:]]


def _idle(p: Vector) -> list[int]:
    """What the part that bends, the part that is held, or the lag would need, where they are not there."""
    of_bent = [] if p[7] < 1.0 and p[2] > 0.0 else [0, 4]
    of_held = [] if p[7] > 0.0 else [1, 5, 6]
    return [*of_bent, *of_held, *([] if p[LAG] > 0.0 else [2, 3])]


def _guesses(ranges: Ranges) -> list[Vector]:
    # Where it cavitates, the limit is about the largest compression force seen.
    most = ranges.compression_force_n or ranges.force_n
    stiffer = 0.2 / max(ranges.displacement_m, 1e-3)
    kinds = (0.0, 0.0), (0.7, 0.0), (0.0, stiffer), (0.7, stiffer)
    shares = (1.0, 0.95, 0.85, 0.7)
    bent: list[Vector] = [
        _point(limit_n=share * most, knee_n=0.05 * most, loss=loss, closing_m=2e-3, rise_per_m=rise)
        for loss, rise in kinds
        for share in shares
    ]
    leaking = _holding(0.95 * most, leak_m_s=0.3 * ranges.velocity_m_s)
    voids = [_void(share * most) for share in (0.95, 0.7)]
    return [*bent, *(_holding(share * most) for share in shares), leaking, *voids]


def _holding(
    limit_n: float,
    rise_per_m: float = 0.0,
    closing_m: float = 1e-4,
    slack: float = 0.0,
    leak_m_s: float = 0.0,
) -> Vector:
    """A sharp limit at which an open cavity holds the force."""
    return _point(
        limit_n=limit_n,
        knee_n=0.005 * limit_n,
        closing_m=closing_m,
        rise_per_m=rise_per_m,
        held=1.0,
        leak_m_s=leak_m_s,
        lag_s=2e-3,
        swing=0.3,
        slack=slack,
    )


def _void(limit_n: float) -> Vector:
    """A limit that bends the force, beyond which a small void opens that the way back closes at no force."""
    return _point(limit_n=limit_n, knee_n=0.1 * limit_n, loss=0.9, closing_m=2e-4, refilled=0.7, most_m=1e-3)


def _point(**values: float) -> Vector:
    """The parameters of these names, the rest neutral."""
    return tuple(values.get(p.name, p.neutral) for p in EFFECT.parameters)


def _far(ranges: Ranges) -> list[Vector]:
    # A bend of the force ends in a part of what is held, from which no small step leads to all of it.
    most, stiffer = ranges.compression_force_n, 0.15 / max(ranges.displacement_m, 1e-3)
    if not 0.0 < most < LESS * ranges.force_n:
        return []
    plain = [_holding(share * most, rise) for share in (0.95, 0.85) for rise in (0.0, stiffer)]
    return [*plain, _holding(0.95 * most, closing_m=1e-3, slack=1.0), _void(0.95 * most)]


def _beside(p: Vector, _: Ranges) -> list[Vector]:
    # No small step leads from a cavity that is never full to one that is.
    if p[2] <= 0.0 and p[7] <= 0.0:
        return []
    return [(*p[:15], most_m, *p[16:]) for most_m in MOST_M]


EFFECT = Effect(
    name="cavitation",
    stage=Stage.LIMIT,
    summary="The compression force cannot exceed what the gas pressure holds up; beyond, vapour forms.",
    equation=(
        "F / (1 + (|F|/limit')^n)^(1/n) where F < 0, "
        f"limit' = limit (1 - rise x) (1 + warming (T - {REFERENCE_C:g})), at least {LEAST_SHARE:g} limit; "
        f"n = log(1/2) / log(1 - knee/limit), knee/limit at most {SOFTEST:g} there; "
        "cavity y: dy/dt = (1 - refilled) (|v| times the share of F that is held back; by flow: |v| less the "
        "speed at which b1 would be at -limit') - filling y, y at most `most`, less v on the way back "
        "(v > 0), where F is 1 - loss y/(y + closing) of itself, with `turning` loss while F < 0; held: F "
        "goes by that part of y/(y + closing) to -limit' (1 + firming y), where v > 0 to 1 - slack of it, "
        "while y > 0, with dy/dt = -v - v1, where b1 would be that at v1, less leak, as it opens "
        "(1 - refilled) of that less leak, less filling y, and y there without the leak while it opens; what "
        "this takes off F (of b1 where held) comes by swing lag^2 d2/dt2 + lag d/dt + 1"
    ),
    source="The chamber's pressure falls to the vapour's; Dixon, The Shock Absorber Handbook, 2nd ed.",
    parameters=(
        Parameter("limit_n", "N", NO_LIMIT_N, 50.0, NO_LIMIT_N, 1000.0, "largest compression force"),
        Parameter(
            "knee_n",
            "N",
            50.0,
            1.0,
            5e3,
            50.0,
            "what F lacks of the limit where it would be at it",
            partial=True,
        ),
        Parameter("loss", "1", 0.0, 0.0, 1.0, 0.0, "of the rebound force while a cavity is open", 0.3),
        Parameter(
            "closing_m", "m", 2e-3, 1e-5, 0.02, 2e-3, "cavity at which half of that is lost", partial=True
        ),
        Parameter(
            "rise_per_m",
            "1/m",
            0.0,
            0.0,
            50.0,
            0.0,
            "growth of the limit as the rod goes in",
            1.0,
            optional=True,
        ),
        Parameter(
            "refilled",
            "1",
            0.0,
            0.0,
            0.95,
            0.0,
            "part of the cavity that other flow fills as it opens",
            0.3,
            optional=True,
        ),
        Parameter(
            "warming_per_k",
            "1/K",
            0.0,
            -0.01,
            0.02,
            0.0,
            "growth of the limit as the gas warms",
            1e-3,
            optional=True,
        ),
        Parameter(
            "held",
            "1",
            0.0,
            0.0,
            1.0,
            0.0,
            "part of the limit at which an open cavity holds the force",
            0.3,
            optional=True,
        ),
        Parameter(
            "leak_m_s", "m/s", 0.0, 0.0, 1.0, 0.0, "speed at which other flow closes it", 0.1, optional=True
        ),
        FORCE_LAG,
        FORCE_SWING,
        Parameter(
            "firming_per_m",
            "1/m",
            0.0,
            0.0,
            50.0,
            0.0,
            "growth of the limit with the cavity that holds it",
            3.0,
            optional=True,
        ),
        Parameter(
            "slack",
            "1",
            0.0,
            0.0,
            1.0,
            0.0,
            "part of the limit that is lost while the piston comes back",
            0.3,
            optional=True,
        ),
        Parameter(
            "filling_per_s",
            "1/s",
            0.0,
            0.0,
            2000.0,
            0.0,
            "rate at which other flow closes it, in proportion to itself",
            20.0,
            optional=True,
        ),
        Parameter(
            "by_flow",
            "1",
            0.0,
            0.0,
            1.0,
            0.0,
            "part of it that goes by the flow that lacks, not by the force's share that does",
            0.3,
            optional=True,
        ),
        Parameter(
            "most_m",
            "m",
            NO_MOST_M,
            1e-4,
            NO_MOST_M,
            NO_MOST_M,
            "largest size of the cavity",
            1e-3,
            optional=True,
            endless=True,
        ),
        Parameter(
            "turning",
            "1",
            0.0,
            0.0,
            1.0,
            0.0,
            "part of the loss that a force has which still pushes as the piston turns",
            0.3,
            optional=True,
        ),
    ),
    step=step,
    shape_over=frozenset({"stroke", "velocity"}),
    inverse=Undo.NOT_UNDONE,
    inverse_note="No current lifts the limit: wishes beyond it fall short by what exceeds it.",
    guesses=_guesses,
    far=_far,
    beside=_beside,
    idle=_idle,
    start=start,
    states=(
        "cavity, m",
        "cavity that holds, m",
        "taken off the force, N",
        "taken off before, N",
        "speed at which it opens, m/s",
        "speed at which the other opens, m/s",
        "what other flow filled of the other as it opened, m",
    ),
)
