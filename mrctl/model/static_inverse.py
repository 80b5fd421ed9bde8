"""The exact inverse of the static model: from a force to the current that makes it (Eq. 8.1, 3.3).

At one temperature f(i) h(i) is a ladder of forces, one rung at each corner of f or of h; between two rungs
both are linear in the current and their product is a quadratic that is solved exactly. Where h goes over
from its off to its on state continuously there is one ladder. Where it switches there are two, one for each
state: both are tried and the one that has the force is taken; where both or neither have it, the state the
damper was in stays, so that nothing chatters.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from enum import IntEnum
from itertools import pairwise
from math import sqrt
from typing import NamedTuple

from mrctl.model.static import StaticTables, on_weight
from mrctl.model.tables import interpolate


class Reach(IntEnum):
    """Where a wish lies against the forces that the damper can give at this velocity and temperature."""

    BELOW = -1  # less force than without current, or force that would drive
    WITHIN = 0
    ABOVE = 1  # more force than at the largest current


BELOW, WITHIN, ABOVE = Reach


class StaticInverse(NamedTuple):
    """A current, the hypothesis it stands on, and whether the wish was within reach."""

    current_a: float
    on: bool
    reach: Reach


class _Ladder:
    """Forces f(i) h(i) increasing with the current, and the segments to go back on."""

    __slots__ = ("first_a", "forces", "highest_n", "last_a", "lowest_n", "segments")

    def __init__(self, rungs: list[tuple[float, float, float]]) -> None:
        """rungs: (current, f, h), in order of the current."""
        self.forces = [f * h for _, f, h in rungs]
        self.first_a, self.last_a = rungs[0][0], rungs[-1][0]
        # Beyond the ends the current stays: one more segment on either side, without a span.
        self.segments = [
            (self.first_a, 0.0, 0.0, 1.0, 0.0),
            *(
                (i0, i1 - i0, (f1 - f0) * (h1 - h0), f0 * (h1 - h0) + h0 * (f1 - f0), f0 * h0)
                for (i0, f0, h0), (i1, f1, h1) in pairwise(rungs)
            ),
            (self.last_a, 0.0, 0.0, 1.0, 0.0),
        ]
        self.lowest_n, self.highest_n = self.forces[0], self.forces[-1]


class StaticInverter:
    """Inverts the static model of one damper, at the temperature it was last warmed to."""

    __slots__ = ("_current_max_a", "_high", "_low", "_on_above_a", "_strongest_n", "_tables")

    def __init__(self, tables: StaticTables, current_max_a: float, temperature_c: float) -> None:
        self._tables = tables
        self._on_above_a = tables.on_above_a
        self._current_max_a = current_max_a
        self.warm_to(temperature_c)

    def warm_to(self, temperature_c: float) -> None:
        """Work out the ladders of this temperature."""
        t, top = self._tables, self._current_max_a
        h_off = interpolate(temperature_c, t.temperature_c, t.h_off)
        h_on = interpolate(temperature_c, t.temperature_c, t.h_on)
        inner = (i for i in (*t.current_a, t.off_below_a, t.on_above_a) if 0.0 < i < top)
        corners = sorted({0.0, top, *inner})
        rungs = [
            (
                i,
                interpolate(i, t.current_a, t.force_n),
                h_off + on_weight(i, t.off_below_a, t.on_above_a) * (h_on - h_off),
            )
            for i in corners
        ]
        self._low: _Ladder | None = None  # the off state's ladder, where h switches
        switch_a = t.on_above_a
        if t.off_below_a < switch_a or not 0.0 < switch_a <= top:
            self._high = _Ladder(rungs)
        else:
            edge = (math.nextafter(switch_a, 0.0), interpolate(switch_a, t.current_a, t.force_n), h_off)
            self._low = _Ladder([*(rung for rung in rungs if rung[0] < switch_a), edge])
            self._high = _Ladder([rung for rung in rungs if rung[0] >= switch_a])
        self._strongest_n = self._high.highest_n

    def invert(
        self,
        force_n: float,
        g: float,
        was_on: bool,  # noqa: FBT001  # positional, for speed
    ) -> tuple[float, bool, Reach]:
        """As StaticInverse: the current where f(i) h(i) g is the wish, or comes nearest to it.

        Total: no g, not even zero, divides by zero.
        """
        if force_n * g <= 0.0:
            return 0.0, False, WITHIN if force_n == 0.0 and g == 0.0 else BELOW
        if g < 0.0:
            force_n, g = -force_n, -g
        if force_n >= self._strongest_n * g:
            return self._current_max_a, True, ABOVE if force_n > self._strongest_n * g else WITHIN
        q = force_n / g  # bounded by the line above, however small g is
        ladder, low = self._high, self._low
        if low is not None:
            on_has_it = q >= ladder.lowest_n
            if q <= low.highest_n and not (on_has_it and was_on):
                ladder = low
            elif not on_has_it:  # the gap
                return (ladder.first_a, True, WITHIN) if was_on else (low.last_a, False, WITHIN)
        if q < ladder.lowest_n:
            return 0.0, False, BELOW
        start, span, a, b, c = ladder.segments[bisect_right(ladder.forces, q)]
        c -= q
        # a s^2 + b s + c = 0 with c <= 0, in the form that is exact for a = 0 too; b > 0: the force increases
        current_a = start - 2.0 * c * span / (b + sqrt(b * b - 4.0 * a * c))
        return current_a, current_a >= self._on_above_a, WITHIN


def invert_backbone(
    force_n: float,
    velocity_m_s: float,
    temperature_c: float,
    t: StaticTables,
    current_max_a: float,
    *,
    was_on: bool,
) -> StaticInverse:
    """The current whose static force is the wish, or comes nearest to it (Eq. 8.1, 3.3)."""
    g = interpolate(velocity_m_s, t.velocity_m_s, t.shape)
    return StaticInverse(*StaticInverter(t, current_max_a, temperature_c).invert(force_n, g, was_on))
