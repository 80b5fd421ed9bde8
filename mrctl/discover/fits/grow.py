"""A model with one effect more or less, and the valleys that a fit of it may end in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.anew import best_anew
from mrctl.discover.fits.proof import Proof, prove
from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE, TOLERANCE, pursued, raced
from mrctl.discover.fits.screen import Look, Screen, ranges_of
from mrctl.discover.fits.tangent import Tangent
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import Penalty, weighed_as
from mrctl.identify.plain_lags import free_to_be_late, with_lag_of_two, with_late_split, with_plain_lag
from mrctl.identify.processes import in_processes
from mrctl.identify.solver import covariance
from mrctl.model.effects.base import Effect, Stage, Vector

Array = NDArray[np.float64]
Folds = Sequence[tuple[int, ...]]

DEAR_TOGETHER = {Stage.MOTION, Stage.YIELD}  # no slope of theirs is known but by differences
_WINDING = (Stage.MOTION, Stage.TEMPERATURE)  # whose first look says little about where they end
WORTH_MOVING = 0.5  # of the cost, a negative log-likelihood: less is the same fit
WORTH_FREEING = 10.0  # as WORTH_MOVING, for a parameter that the base had taken up
ITERATIONS = 20
HARDLY_ANY = 0.02  # of an effect, to begin with
WARMER = (1.0, 2.5)  # times the fluid's rise that was found
QUIETER = 0.5  # of the mean square that a model was weighed by


def grown(before: Tangent, look: Look, more_heats: int = 0, known: float = np.inf) -> JointFit:
    """A fit with one more effect, base and effects moving together, weights as they are.

    It begins where it costs least: with the base settled around the look, with the base as it was, with less
    of the effect, or hardly any, and where all of these cost more than none, with hardly any of a typical
    one; with the base fitted anew beside the effect as it looked; or at the first of these with a plain lag
    for the filter, some effects from all their starting points, a warmth also with h fitted anew; what yields
    beside bases that never met it.
    more_heats: as `raced` has it; one whose values are known needs none. known: a total cost below
    which it must come to be of use.
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
    cut = before.few(effect) is not fit.model
    return raced(every, heat, fitted, model.cost, ITERATIONS, min(known, fit.total), more_heats, few=cut)


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


def warmer(fit: JointFit) -> list[Array]:
    """For each effect on the temperature the vector with h straight and the fluid as warm, and warmer.

    A fluid too little warmed bends h to and fro between its knots to make up for it, and stays so.
    """
    layout, found = fit.model.layout, []
    rise = layout.temperature_c[layout.free_h] - layout.temperature_c[layout.reference]
    straight = fit.theta.copy()
    for name in ("h_on", "h_off"):
        h = straight[layout.parts[name]]
        if h.size:  # off is as on where only one of them was measured
            h[:] = rise * float(rise @ h) / float(rise @ rise)
    for effect in fit.model.effects.chosen:
        if effect.stage is Stage.TEMPERATURE:
            own = fit.model.effects.parameters
            rises = np.array([e is effect and p.unit.partition("/")[0] == "K" for e, p in own])
            for times in WARMER:
                start = straight.copy()
                start[layout.size :][rises] *= times
                found.append(start)
    return found


def grown_by(fit: JointFit, effect: Effect, values: Vector | None = None) -> JointFit:
    """A fit with one more effect, begun at given values (SI) or where a look finds that it takes most.

    All records count alike in the look: those that fit badly without it are those that show it.
    """
    model = replace(fit.model, minimum_phase=True)
    model.weigh_as(fit.model)
    if values is None and np.ptp(model.noise_n) > 0.0:
        model.reweigh(fit.theta)
    penalties = weighed_as(fit.penalties, model.penalties())
    lag = model.fit(fit.theta, penalties=penalties, rounds=1, iterations=ITERATIONS, tolerance=TOLERANCE)
    tangent = Tangent.of(lag)
    screen = Screen(tangent)
    if values is None:
        _, start = max(screen.glance(effect), key=lambda one: one[0])
        look = screen.climb(effect, start)
    else:
        look = screen.at(effect, values)
    return grown(tangent, look)


def without(proof: Proof, name: str, folds: Folds) -> Proof:
    """The same model less one effect, fitted anew from where it stands.

    What of the others did not move beside it may now: a spring's preload beside a constant force, say.
    """
    bare = proof.fit.less({name})
    free = bare.moving
    fit = _quick(bare.model, bare.theta, bare.penalties, free)
    return prove(_freed(fit, free, bare.theta), folds)


def settled(proof: Proof, folds: Folds) -> Proof:
    """The fit of a model that was found, at the noise that it leaves and with all that its effects can move.

    Tables are as smooth as the noise demands: those smoothed for the error of a model without the effect
    leave an error of their own. What that model took up of an effect, this one may not. And where its filter
    went to make up for the effect, no small step may lead back from: so two plain lags are tried too, for a
    fluid that warms up other warmths, and what else an effect knows beside what it was fitted to.
    """
    fit = proof.fit
    model, free = fit.model, fit.moving
    starts = [with_lag_of_two(model, fit.theta), *warmer(fit), *_beside(fit)]
    least = min(in_processes(partial(_elsewhere, fit), starts, [model]), key=lambda one: one.total)
    moved = least.total < fit.total - WORTH_MOVING
    fit = least if moved else fit
    quiet = proof.mean_square < QUIETER * float(np.mean(model.noise_n**2))
    if quiet:
        model = model.with_effects(model.effects)
        model.reweigh(fit.theta)
        fit = _quick(model, fit.theta, fit.penalties, free)
        spread = covariance(fit.solution.normal, fit.penalties, fit.solution.held)
        fit = _quick(model, fit.theta, [p.reweighed(fit.theta, spread) for p in fit.penalties], free)
    wider = _freed(fit, free, fit.theta)
    return prove(wider, folds) if quiet or moved or wider is not fit else proof


def _beside(fit: JointFit) -> list[Array]:
    """The vector with each effect where no small step of it leads, as the effect itself knows."""
    model, found = fit.model, []
    for effect in model.effects.chosen:
        if effect.beside is not None:
            points = effect.beside(fit.effect_values[effect.name], ranges_of(model.records))
            found += [model.with_effect_at(fit.theta, effect, values) for values in points]
    return found


def _freed(fit: JointFit, free: NDArray[np.bool_], theta: Array) -> JointFit:
    """The fit from theta with all that its effects can move, where that is worth it; else the one given."""
    held = np.count_nonzero(fit.model.free() & ~free)
    if not held:
        return fit
    wider = _quick(fit.model, theta, fit.penalties, fit.model.free())
    return wider if wider.total < fit.total - WORTH_FREEING * held else fit


def _quick(
    model: JointModel, theta: Array, penalties: Sequence[Penalty], free: NDArray[np.bool_]
) -> JointFit:
    return model.fit(
        theta, penalties=penalties, free=free, rounds=1, iterations=ITERATIONS, tolerance=TOLERANCE
    )


def again(proof: Proof, base: Array, folds: Folds, known: float = np.inf) -> Proof:
    """The better of a fit and the same fit begun with another base; known: as `grown` has it."""
    fit = proof.fit
    other = _elsewhere(fit, np.concatenate([base, fit.theta[base.size :]]), known)
    return prove(other, folds) if other.total < fit.total - WORTH_MOVING else proof


def _elsewhere(fit: JointFit, theta: Array, known: float = np.inf) -> JointFit:
    """The same fit begun elsewhere, ended early where it is not on its way to better this and `known`."""
    fitted = partial(fit.model.fit, penalties=fit.penalties, free=fit.moving, rounds=1)
    return pursued(fitted, theta, ITERATIONS, min(known, fit.total - WORTH_MOVING))
