"""Fits of the base model to the records of a search, before any effect is looked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from mrctl.discover.channels.step_times import trusted
from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE, TOLERANCE, heats_of
from mrctl.discover.fits.trusting import as_plain, fitted_trusting
from mrctl.identify.best import fit_base
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import weighed_as
from mrctl.identify.plain_lags import with_lag_of_two, with_plain_lag
from mrctl.identify.processes import in_processes
from mrctl.identify.records import Record, possible_rise_k
from mrctl.model.effects.base import Effect, Vector

STEPLESS_ITERATIONS = 30
MOST_PROMISING = 3  # of the places where a fit may begin as well, after a few iterations from each


def base_fit(
    records: Sequence[Record],
    known: Sequence[Effect] = (),
    values: dict[str, Vector] | None = None,
    start: JointFit | None = None,
) -> JointFit:
    """The base model with known effects, begun at their values (SI), fitted to records.

    start: a fit without effects to begin with. Every record counts with the noise of the whole fit: one that
    fits badly is what is looked for, and must not be weighed down.
    """
    fit = fit_base(records, warmer_k=possible_rise_k(records)) if start is None else start
    model = JointModel(fit.model.layout, records, Effects(tuple(known)), minimum_phase=True)
    theta = np.concatenate([fit.theta[: fit.model.layout.size], model.effects.pack(values or {})])
    model.reweigh(theta)
    penalties = weighed_as(fit.penalties, model.penalties())
    fitted = partial(JointModel.fit, model, penalties=penalties, rounds=1, iterations=30, tolerance=1e-5)
    fit = fitted(theta)
    if start is not None:  # the fit that all rests on: in no worse valley than plain lags lead to
        lags = with_plain_lag(model, fit.theta), with_lag_of_two(model, fit.theta)
        others = in_processes(partial(fitted, known=fit.total), lags, [model])
        fit = min(fit, *others, key=lambda one: one.total)
    return fit


def stepless(records: Sequence[Record], fit: JointFit) -> JointFit:
    """A fit's base as the data show it that do not hang on when between two samples a current stepped.

    A filter that has made up for the steps' times hides when they were. What effects move stays.
    """
    model = _weighed_alike(records, fit)
    trust = trusted(records, [model.factor(r) for r in records])
    if all(own.all() for own in trust):
        return fit
    free = np.arange(model.size) < model.layout.size
    begin = JointFit(model, fit.solution, fit.penalties)
    fits = [
        fitted_trusting(begin, theta, trust, STEPLESS_ITERATIONS, free=free, tolerance=TOLERANCE)
        for theta in (fit.theta, with_plain_lag(model, fit.theta))
    ]
    return as_plain(begin, min(fits, key=lambda one: one.total).theta)


def _weighed_alike(records: Sequence[Record], fit: JointFit) -> JointModel:
    """The model on other versions of its records."""
    model = fit.model.on(records)
    model.weigh_as(fit.model)
    return model


def fitted_to(
    records: Sequence[Record], fit: JointFit, others: Sequence[Mapping[str, Vector]] = ()
) -> JointFit:
    """The same model fitted to other records, each weighed as its like was.

    others: effects' parameters (SI) to begin at as well, of which those that a few iterations promise most of
    go on; the best fit counts.
    """
    model = _weighed_alike(records, fit)
    fitted = partial(model.fit, penalties=fit.penalties, rounds=1, iterations=10, tolerance=1e-4)
    here = fitted(fit.theta)
    if not others:
        return here
    begins = [model.pack(fit.tables, {**fit.effect_values, **values}) for values in others]
    heats = heats_of(partial(fitted, iterations=HEAT, tolerance=HEAT_TOLERANCE, passing=True), begins)
    best = here
    for heat in sorted(heats, key=lambda one: one.promised)[:MOST_PROMISING]:
        best = min(best, fitted(heat.theta, known=best.total), key=lambda one: one.total)
    return best
