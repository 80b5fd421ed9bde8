"""A model with one effect more, and the valleys that a fit of it may end in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.anew import best_anew
from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE, TOLERANCE, near_cost, raced
from mrctl.discover.fits.screen import Look, Screen, ranges_of
from mrctl.discover.fits.tangent import Tangent
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import weighed_as
from mrctl.identify.plain_lags import free_to_be_late, with_late_split, with_plain_lag
from mrctl.model.effects.base import Effect, Stage, Vector

Array = NDArray[np.float64]
Folds = Sequence[tuple[int, ...]]

DEAR_TOGETHER = {Stage.MOTION, Stage.YIELD}  # no slope of theirs is known but by differences
_WINDING = (Stage.MOTION, Stage.TEMPERATURE)  # whose first look says little about where they end
ITERATIONS = 20
HARDLY_ANY = 0.02  # of an effect, to begin with


def grown(before: Tangent, look: Look, more_heats: int = 0, best: JointFit | None = None) -> JointFit:
    """A fit with one more effect, base and effects moving together, weights as they are.

    It begins where it costs least: with the base settled around the look, with the base as it was, with less
    of the effect, or hardly any, and where all of these cost more than none, with hardly any of a typical
    one; with the base fitted anew beside the effect as it looked; or at the first of these with a plain lag
    for the filter, some effects from all their starting points, a warmth also with h fitted anew; what yields
    beside bases that never met it.
    more_heats: as `raced` has it; one whose values are known needs none. best: the best fit so far with
    another effect more, which this one must come near to be of use.
    """
    fit = before.fit
    effect = look.effect
    alone = Effects((effect,))
    model = fit.model.with_effects(Effects((*fit.model.effects.chosen, effect)))
    own, neutral = alone.pack({effect.name: look.values}), alone.pack({effect.name: effect.neutral})

    def with_some(share: float, whole: Array) -> Array:
        return np.concatenate([fit.theta, (1.0 - share) * neutral + share * whole])

    starts = [
        np.concatenate([look.settled, own]),
        np.concatenate([fit.theta, own]),
        with_some(0.3, own),
        with_some(HARDLY_ANY, own),
    ]
    few = before.few(effect).with_effects(model.effects)
    heat, fitted = (
        partial(
            on.fit,
            penalties=weighed_as(fit.penalties, model.penalties()),
            free=np.concatenate([fit.moving, look.free]),
            rounds=1,
        )
        for on in (few, model)
    )
    least, start = min(((model.cost(one), one) for one in starts), key=lambda pair: pair[0])
    again, settled = [start], []
    if least > fit.total:
        # The look was farther than the base's slopes reach, and what it promised is not there.
        again.append(with_some(HARDLY_ANY, alone.pack({effect.name: effect.typical})))
    stages = {e.stage for e in model.effects.chosen}
    if not stages >= DEAR_TOGETHER:
        beside = np.concatenate([fit.moving, np.zeros(own.size, dtype=bool)])
        heated = partial(heat, free=beside, iterations=HEAT, tolerance=HEAT_TOLERANCE, passing=True)
        settled = [heated(starts[1]).theta]
        if effect.stage in _WINDING:
            points = [alone.pack({effect.name: p}) for p in effect.starting_points(ranges_of(model.records))]
            again += [np.concatenate([fit.theta, point]) for point in points]
            if effect.stage is Stage.TEMPERATURE:
                cold = without_temperature(fit)
                settled += [heated(np.concatenate([cold, point])).theta for point in points]
        if effect.stage is Stage.YIELD:
            settled += best_anew(fit, effect, heat)
    if effect.stage is Stage.OUTPUT and effect.parameters[0].unit == "s":
        settled += [
            np.concatenate([theta, alone.pack({effect.name: own})])
            for theta, own in _late(fit, before.few(effect), effect)
        ]
    every = [start, *settled, *(with_plain_lag(model, one) for one in again)]
    known = fit.total if best is None else near_cost(fit.total, best.total)
    there = None if before.few(effect) is fit.model else _known_to_few(before.few(effect), fit, best)
    return raced(every, heat, fitted, model.cost, ITERATIONS, known, more_heats, few=there)


def _known_to_few(few: JointModel, fit: JointFit, best: JointFit | None) -> float:
    """The total cost, of a few records, below which a model must come to be near the best one."""
    if best is None:
        return np.inf
    return near_cost(*(replace(one, model=few.with_effects(one.model.effects)).total for one in (fit, best)))


def _late(fit: JointFit, few: JointModel, effect: Effect) -> list[tuple[Array, Vector]]:
    """The vector, and the effect's values, of a filter that was let be late, its delay taken out of it.

    A filter that has to make up for a delay with lags goes where no small step leads back from.
    """
    model = free_to_be_late(few)
    fitted = partial(model.fit, penalties=fit.penalties, free=fit.moving, rounds=1, passing=True)
    found = []
    for theta in (fit.theta, with_plain_lag(model, fit.theta)):
        late = fitted(theta, iterations=2 * HEAT)
        begin, delay_s = with_late_split(model, late.theta)
        if delay_s > 0.0:
            high = effect.parameters[0].high
            found.append((begin, (min(delay_s, high), *effect.typical[1:])))
    return found


def without_temperature(fit: JointFit) -> Array:
    """The vector with h = 1: a base that had to make up for a fluid's own warmth has it in its h.

    From there no step leads to the h of a fluid that warms up, and above the case's temperatures it has none.
    """
    parts, theta = fit.model.layout.parts, fit.theta.copy()
    for name in ("h_on", "h_off"):
        theta[parts[name]] = 0.0
    return theta


def grown_by(fit: JointFit, effect: Effect, values: Vector | None = None) -> JointFit:
    """A fit with one more effect, begun at given values (SI) or where a look finds that it takes most."""
    tangent = _settled_tangent(fit, alike=values is None)
    screen = Screen(tangent)
    return grown(tangent, _most(screen, effect) if values is None else screen.at(effect, values))


def grown_by_each(fit: JointFit, effects: Sequence[Effect]) -> list[JointFit]:
    """Fits with one more effect each, begun where a look finds that it takes most."""
    tangent = _settled_tangent(fit, alike=True)
    screen = Screen(tangent)
    return [grown(tangent, _most(screen, effect)) for effect in effects]


def _settled_tangent(fit: JointFit, *, alike: bool) -> Tangent:
    """The tangent of a model held to lags; alike: at weights by which all records count alike.

    Those that fit badly without an effect are those that show it.
    """
    model = replace(fit.model, minimum_phase=True)
    model.weigh_as(fit.model)
    if alike and np.ptp(model.noise_n) > 0.0:
        model.reweigh(fit.theta)
    penalties = weighed_as(fit.penalties, model.penalties())
    lag = model.fit(fit.theta, penalties=penalties, rounds=1, iterations=ITERATIONS, tolerance=TOLERANCE)
    return Tangent.of(lag)


def _most(screen: Screen, effect: Effect) -> Look:
    _, start = max(screen.glance(effect), key=lambda one: one[0])
    return screen.climb(effect, start)
