"""What a piston feels beside f g h, told to a motion effect that carries the whole damper.

A spring in series bears all of it: with the fluid a gas spring, a seal's friction, an orifice; and the
fluid's force as a bypass or an off-state changes it. What these come to hangs on the piston's motion that is
looked for. So at each sample they are asked where the piston is expected, and the forces a little faster too:
the line through both is what the motion effect solves its balance with, and as steep as it may be no step is
too long for it. Where the piston then turns out to turn, a friction may have turned as well: the speed is
halved in until the line is one through what is felt to both sides of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mrctl.model.effects.base import Effect, Settings, Stage, Vector

FASTER_M_S = 1e-4
HALVINGS = 14  # of the change of speed at a turn
SAME = 1e-6  # share of a force
ALONE = 1.0, 0.0, 0.0  # factor, force and slope where f g h is all there is

Pairs = Sequence[tuple[Effect, Vector]]


def expected(
    velocity_m_s: float, displacement_m: float, given_m_s: float, given_m: float, dt_s: float
) -> tuple[float, float]:
    """The piston's velocity in m/s and displacement in m if it gives way as fast as it did.

    given_m_s, given_m: by how much less than the rod it moved, and had moved, at the sample before.
    """
    return velocity_m_s - given_m_s, displacement_m - given_m - dt_s * given_m_s


def line(here_n: float, there_n: float, here_m_s: float, way_m_s: float) -> tuple[float, float]:
    """The force in N of a piston at rest, and its slope in N s/m, from those at a velocity and beyond it.

    The slope is never negative: a force that falls with speed is taken as it is at the first.
    """
    slope = max((there_n - here_n) / way_m_s, 0.0) if way_m_s > 0.0 else 0.0
    return here_n - slope * here_m_s, slope


def turns_early(near_m_s: float, piston_m_s: float, beyond_n: float, force_n: float) -> bool:
    """Whether a piston that turns by a line turns because the force it feels there is another.

    near_m_s: where the line was taken; piston_m_s: where it leads; beyond_n: by how much the force there is
    more than the line's, force_n.
    """
    if near_m_s * piston_m_s >= 0.0 or abs(beyond_n) <= SAME * abs(force_n):
        return False
    return (beyond_n > 0.0) == (piston_m_s > 0.0)


def felt(chosen: Settings) -> tuple[Pairs, Pairs]:
    """The effects that multiply f g h at the piston, and those that act beside it, each in their order."""
    factors, additive, rod = (
        [pair for pair in chosen.get(stage, ()) if pair[0].felt]
        for stage in (Stage.FACTOR, Stage.ADDITIVE, Stage.ROD)
    )
    return factors, additive + rod


def preload(acting: Pairs, current_a: float, temperature_c: float, dt_s: float) -> float:
    """What they come to in N at rest in mid stroke: a mount's deflection counts from where that leaves it."""
    still = 0.0, 0.0, 0.0, current_a, temperature_c, dt_s
    return _sum(acting, [effect.initial(p, *still) for effect, p in acting], *still)


class Beside:
    """All of them at work, sample by sample, with states of their own."""

    __slots__ = ("_acting", "_factors", "_forces", "_given", "_products", "preload_n")

    def __init__(self, factors: Pairs, acting: Pairs) -> None:
        self._factors, self._acting = factors, acting
        self.restart()

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self._acting or self._factors)

    def restart(self) -> None:
        """Begin anew at the next sample."""
        self._products: list[list[float]] | None = None
        self._forces: list[list[float]] = []
        self._given = 0.0, 0.0
        self.preload_n = 0.0

    def look(
        self, v: float, x: float, a: float, current_a: float, temperature_c: float, dt_s: float
    ) -> tuple[float, float, float]:
        """At this sample of the rod's motion: the factor on f g h, and the forces beside as `line` has it."""
        v, x = expected(v, x, *self._given, dt_s)
        rest = a, current_a, temperature_c, dt_s
        here, faster = self._force(v, x, 0.0, *rest), self._force(v, x, FASTER_M_S, *rest)
        factor = _product(self._factors, _copied(self._products or []), v, x, *rest[1:])
        return factor, *line(here, faster, v, FASTER_M_S)

    def ahead(
        self,
        piston_m_s: Callable[[float, float, float], float],
        v: float,
        x: float,
        a: float,
        current_a: float,
        temperature_c: float,
        dt_s: float,
    ) -> tuple[float, float, float]:
        """As `look`, once more where the piston turns by it: `piston_m_s` says how fast it leads to."""
        rest = a, current_a, temperature_c, dt_s
        factor, force, slope = self.look(v, x, *rest)
        v, x = expected(v, x, *self._given, dt_s)
        v1 = piston_m_s(factor, force, slope)
        if v * v1 >= 0.0:
            return factor, force, slope
        there, by_line = self._force(v, x, v1 - v, *rest), force + slope * v1
        if not turns_early(v, v1, there - by_line, by_line):
            return factor, force, slope
        low, high = min(v, v1), max(v, v1)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if piston_m_s(factor, self._force(v, x, middle - v, *rest), 0.0) > middle:
                low = middle
            else:
                high = middle
        ends = self._force(v, x, low - v, *rest), self._force(v, x, high - v, *rest)
        return factor, *line(*ends, low, high - low)

    def _force(
        self, v: float, x: float, faster: float, a: float, i: float, warm: float, dt_s: float
    ) -> float:
        """What acts beside f g h at a piston so much faster than expected."""
        if self._products is None:
            self._products = [effect.initial(p, v, x, i, warm, dt_s) for effect, p in self._factors]
            self._forces = [effect.initial(p, v, x, a, i, warm, dt_s) for effect, p in self._acting]
            self.preload_n = preload(self._acting, i, warm, dt_s)
        states = _copied(self._forces)
        total = _sum(self._acting, states, v + faster, x + faster * dt_s, a, i, warm, dt_s)
        return total - self.preload_n

    @property
    def states(self) -> list[list[float]]:
        """Each effect's, the factors' first; none before the first look."""
        return [*(self._products or []), *self._forces]

    def follow(
        self,
        given: tuple[float, float],
        v: float,
        x: float,
        a: float,
        current_a: float,
        temperature_c: float,
        dt_s: float,
    ) -> None:
        """Go on with the piston's motion, `given` by how much less than the rod it moves and has moved."""
        rest = current_a, temperature_c, dt_s
        _product(self._factors, self._products or [], v, x, *rest)
        _sum(self._acting, self._forces, v, x, a, *rest)
        self._given = given


def _copied(states: list[list[float]]) -> list[list[float]]:
    return [list(s) for s in states]


def _product(pairs: Pairs, states: list[list[float]], *inputs: float) -> float:
    product = 1.0
    for (effect, p), s in zip(pairs, states, strict=True):
        product *= effect.step(p, s, *inputs)
    return product


def _sum(pairs: Pairs, states: list[list[float]], *inputs: float) -> float:
    total = 0.0
    for (effect, p), s in zip(pairs, states, strict=True):
        total += effect.step(p, s, *inputs)
    return total
