"""Effects begun anew beside those that were found after them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from mrctl.discover.fits.grow import ITERATIONS, Folds
from mrctl.discover.fits.proof import Proof, prove
from mrctl.discover.fits.race import raced
from mrctl.discover.fits.sample import remembers_long, sampled
from mrctl.discover.fits.screen import ranges_of
from mrctl.discover.fits.settle import WORTH_MOVING, settled
from mrctl.identify.joint_fit import JointFit
from mrctl.model.effects.base import Effect


def renewed(proof: Proof, chosen: Sequence[Effect], folds: Folds) -> Proof:
    """The model with each effect begun once more from its starting points, wherever that fits better.

    The first of two effects makes up for the second while that is missing, and may go to a bound, from which
    no small step leads back when the second has come.
    """
    fit = proof.fit
    for effect in chosen:
        fit = _anew(fit, effect)
    return proof if fit is proof.fit else settled(prove(fit, folds), folds)


def _anew(fit: JointFit, effect: Effect) -> JointFit:
    """The better of a fit and the same one with an effect begun anew."""
    model = fit.model
    few = sampled(model, fit.theta, whole=remembers_long(model.effects.chosen))
    heat, fitted = (
        partial(on.fit, penalties=fit.penalties, free=fit.moving, rounds=1) for on in (few, model)
    )
    points = effect.starting_points(ranges_of(model.records))
    starts = [model.pack(fit.tables, {**fit.effect_values, effect.name: point}) for point in points]
    if not starts:
        return fit
    other = raced(starts, heat, fitted, model.cost, ITERATIONS, fit.total)
    return other if other.total < fit.total - WORTH_MOVING else fit
