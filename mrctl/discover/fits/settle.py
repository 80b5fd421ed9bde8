"""A model that has been found, settled: at its noise, all moving, in the best valley that is known."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.grow import ITERATIONS, Folds
from mrctl.discover.fits.proof import Proof, prove
from mrctl.discover.fits.race import TOLERANCE, pursued
from mrctl.discover.fits.sample import remembers_long, sampled
from mrctl.discover.fits.screen import ranges_of
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import Penalty
from mrctl.identify.plain_lags import with_lag_of_two
from mrctl.identify.processes import in_processes
from mrctl.identify.solver import covariance
from mrctl.model.effects.base import Stage

Array = NDArray[np.float64]

WORTH_MOVING = 0.5  # of the cost, a negative log-likelihood: less is the same fit
WORTH_FREEING = 10.0  # as WORTH_MOVING, for a parameter that the base had taken up
WARMER = (1.0, 2.5)  # times the fluid's rise that was found
QUIETER = 0.5  # of the mean square that a model was weighed by


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
    ends = in_processes(partial(_elsewhere, fit), _worth_going(fit, starts), [model])
    least = min(ends, key=lambda one: one.total, default=fit)
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


def _worth_going(fit: JointFit, starts: Sequence[Array]) -> list[Array]:
    """Where fits to a few records end that are begun elsewhere, if lower than from where the fit stands."""
    model = fit.model
    few = sampled(model, fit.theta, whole=remembers_long(model.effects.chosen))
    if few is model:
        return list(starts)
    fitted = partial(few.fit, penalties=fit.penalties, free=fit.moving, rounds=1, passing=True)
    here = fitted(fit.theta, iterations=ITERATIONS, tolerance=TOLERANCE).total
    share = sum(map(len, few.records)) / sum(map(len, model.records))
    lower = here - WORTH_MOVING * share
    ends = in_processes(lambda start: pursued(fitted, start, ITERATIONS, lower), starts, [few])
    return [one.theta for one in ends if one.total < lower]


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
