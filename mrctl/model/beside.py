"""What a piston feels beside f g h, told to a motion effect that carries the whole damper.

A spring in series bears all of it: with the fluid a gas spring, a seal's friction, an orifice; and the
fluid's force as a bypass or an off-state changes it. What these come to hangs on the piston's motion that is
looked for. So at each sample they are asked where the piston is expected, and the forces a little faster too:
the line through both is what the motion effect solves its balance with, and as steep as it may be no step is
too long for it.
"""

from __future__ import annotations

from collections.abc import Sequence

from mrctl.model.effects.base import Effect, Settings, Stage, Vector

FASTER_M_S = 1e-4
ALONE = 1.0, 0.0, 0.0  # factor, force and slope where f g h is all there is

Pairs = Sequence[tuple[Effect, Vector]]


def expected(
    velocity_m_s: float, displacement_m: float, given_m_s: float, given_m: float, dt_s: float
) -> tuple[float, float]:
    """The piston's velocity in m/s and displacement in m if it gives way as fast as it did.

    given_m_s, given_m: by how much less than the rod it moved, and had moved, at the sample before.
    """
    return velocity_m_s - given_m_s, displacement_m - given_m - dt_s * given_m_s


def line(here_n: float, faster_n: float, velocity_m_s: float) -> tuple[float, float]:
    """The force in N of a piston at rest, and its slope in N s/m, from those at a velocity and beyond it.

    The slope is never negative: a force that falls with speed is taken as it is where the piston is expected.
    """
    slope = max((faster_n - here_n) / FASTER_M_S, 0.0)
    return here_n - slope * velocity_m_s, slope


def felt(chosen: Settings) -> tuple[Pairs, Pairs]:
    """The effects that multiply f g h at the piston, and those that act beside it, each in their order."""
    factors, additive, rod = (
        [pair for pair in chosen.get(stage, ()) if pair[0].felt]
        for stage in (Stage.FACTOR, Stage.ADDITIVE, Stage.ROD)
    )
    return factors, additive + rod


class Beside:
    """All of them at work, sample by sample, with states of their own."""

    __slots__ = ("_acting", "_factors", "_forces", "_given", "_products")

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

    def ahead(
        self, v: float, x: float, a: float, current_a: float, temperature_c: float, dt_s: float
    ) -> tuple[float, float, float]:
        """At this sample of the rod's motion: the factor on f g h, and the forces beside as `line` has it."""
        v, x = expected(v, x, *self._given, dt_s)
        rest = current_a, temperature_c, dt_s
        if self._products is None:
            self._products = [effect.initial(p, v, x, *rest) for effect, p in self._factors]
            self._forces = [effect.initial(p, v, x, a, *rest) for effect, p in self._acting]
        factor = _product(self._factors, _copied(self._products), v, x, *rest)
        here = _sum(self._acting, _copied(self._forces), v, x, a, *rest)
        faster = _sum(self._acting, _copied(self._forces), v + FASTER_M_S, x + FASTER_M_S * dt_s, a, *rest)
        return factor, *line(here, faster, v)

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
