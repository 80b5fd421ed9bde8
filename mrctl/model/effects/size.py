"""Effects in dampers of any size: what is counted in newtons has bounds, steps and starts in proportion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from mrctl.model.effects.base import Effect, Parameter, Ranges, Vector, force_power

SMALLEST_N, LARGEST_N = 500.0, 10_000.0  # peak forces of the dampers that the effects' own figures are for


def sized(effect: Effect, force_n: float) -> Effect:
    """The effect as fits need it for a damper of that peak force, whatever size it has been given before.

    A washing machine's damper makes 100 N, a bridge's 200 kN: a friction of 2 kN, which no car's damper has,
    is nothing there. Lengths, times and temperatures are alike in all.
    """
    effect = effect.usual or effect
    factor = force_n / min(max(force_n, SMALLEST_N), LARGEST_N)
    if factor in (0.0, 1.0):
        return effect
    by = [factor ** force_power(p.unit) for p in effect.parameters]

    def usual(ranges: Ranges) -> Ranges:
        return ranges._replace(
            force_n=ranges.force_n / factor, compression_force_n=ranges.compression_force_n / factor
        )

    def points(of: Callable[[Ranges], Sequence[Vector]]) -> Callable[[Ranges], Sequence[Vector]]:
        return lambda ranges: [_times(point, by) for point in of(usual(ranges))]

    def own_size(values: Vector) -> Vector:
        return _times(values, [1.0 / own for own in by])

    plausible, beside = effect.plausible, effect.beside
    return replace(
        effect,
        parameters=tuple(_sized(p, own) for p, own in zip(effect.parameters, by, strict=True)),
        guesses=effect.guesses and points(effect.guesses),
        far=effect.far and points(effect.far),
        usual=effect,
        beside=beside
        and (lambda values, ranges: [_times(p, by) for p in beside(own_size(values), usual(ranges))]),
        plausible=plausible and (lambda values, ranges: plausible(own_size(values), usual(ranges))),
    )


def _sized(p: Parameter, by: float) -> Parameter:
    return replace(
        p,
        neutral=p.neutral * by,
        low=p.low * by,
        high=p.high * by,
        typical=p.typical * by,
        scale=p.scale * by,
    )


def _times(values: Vector, by: Sequence[float]) -> Vector:
    return tuple(x * own for x, own in zip(values, by, strict=True))
