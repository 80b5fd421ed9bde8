"""Channels taken anew with a model that has been found, and the model fitted to what comes of it.

What a base without its effects had made up for, by other zeros, times or places, shows only then.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.base_fit import fitted_to
from mrctl.discover.channels.field_past import came_down, farther, fields_past
from mrctl.discover.channels.own_recovery import recovers_instead
from mrctl.discover.channels.stroke_zeros import FARTHEST, moved, stroke_zeros
from mrctl.discover.channels.warm_starts import begin_as_fluids_do, more_than_scales, warm_starts, warmed
from mrctl.discover.evidence import WHOLE, Evidence
from mrctl.discover.fits.grow import without_temperature
from mrctl.discover.fits.proof import Proof, log_gain, prove
from mrctl.discover.fits.refit import error_on
from mrctl.discover.fits.screen import ranges_of
from mrctl.discover.fits.settle import settled
from mrctl.discover.fits.thinning import thins_as_it_warms
from mrctl.discover.search.quiet import is_quiet
from mrctl.identify.joint_fit import JointFit
from mrctl.model.effects.base import Effect, Stage

Array = NDArray[np.float64]

STILL_FALLS = 0.98  # of a model's mean square: less than that is not worth other times
PASTS = 3  # times that the runs' pasts are taken: a model has made up for some
WARM_K = 1.0  # that no run's fluid is further from all others: it began as they did
FARTHER = 2.0**0.5  # by which factor all pasts are moved at once
PLACINGS = 6  # as PASTS, of the strokes' zeros: a stop's place and theirs go together
MEASURED = 0.03  # of a run's stroke, that a measured one's zero may be off; ...
MOST_LEFT = 0.5  # ... if that leaves no more of a model's mean square than this, ...
FIRST_LEFT = 0.8  # ... and the first placing alone, before any fit, no more than this


def retimed(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """The steps' times taken anew with a model that has been found, and the model fitted to them.

    A model without the coil's lag put part of it into the times: so it is fitted to the currents as they
    were measured first.
    """
    plain = evidence.of_records(evidence.measured)
    evidence = plain.timed(fitted_to(plain.records, proof.fit))
    return evidence, prove(fitted_to(evidence.records, proof.fit), evidence.folds)


def stepped(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """The steps' times taken anew with what answers them late, or with memory; the same if no better.

    A base without it put the spring's own time, or a coil's, into the steps'.
    """
    if not any(e.stage in (Stage.CURRENT, Stage.MOTION) for e in proof.fit.model.effects.chosen):
        return evidence, proof
    best = min((evidence, proof), retimed(evidence, proof), key=_left)
    # What has made up for wrong times gives way to better ones in turn.
    while (anew := _timed_by(*best))[1].mean_square < STILL_FALLS * best[1].mean_square:
        best = anew
    return best


def _timed_by(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """The steps' times by a model as it stands, and that fitted to them."""
    evidence = evidence.of_records(evidence.measured).timed(proof.fit)
    return evidence, prove(fitted_to(evidence.records, proof.fit), evidence.folds)


def _left(model: tuple[Evidence, Proof]) -> float:
    return model[1].mean_square


def rezeroed(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """The runs' zeros and scales taken anew with a model that has been found, and that fitted to them.

    The same where that leaves more: what is taken out can only help, unless the fit went to another valley.
    """
    anew = evidence.zeroed(proof.fit).evened(proof.fit)
    if anew is evidence:
        return evidence, proof
    there = prove(fitted_to(anew.records, proof.fit), anew.folds)
    return min((evidence, proof), (anew, there), key=_left)


def remembered(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """Each run begun from the current that a model with a field's memory finds, and that fitted to them.

    A field keeps what was on before a run, which no file tells.
    """
    fields = [e for e in proof.fit.model.effects.chosen if e.stage is Stage.CURRENT]
    # What the wrong pasts had bent begins anew.
    others = _beginnings(evidence, fields)
    for _ in range(PASTS if fields else 0):
        past = fields_past(proof.fit.model.on(evidence.full), proof.fit.theta)
        if past is None:
            break
        evidence = evidence.each(past)
        proof = prove(fitted_to(evidence.records, proof.fit, others), evidence.folds)
    return _together(evidence, proof) if fields and came_down(evidence.records) else (evidence, proof)


def _together(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """The pasts farther or nearer, all alike, and the model fitted to them, as far as that leaves less.

    A loop too wide makes up for currents that came down by too little: neither moves without the other.
    """
    best = evidence, proof
    for by in (FARTHER, 1.0 / FARTHER):
        for _ in range(PASTS):
            anew = best[0].each(partial(farther, by=by))
            there = prove(fitted_to(anew.records, best[1].fit), anew.folds)
            if there.mean_square >= STILL_FALLS * best[1].mean_square:
                break
            best = anew, there
        if best[1] is not proof:
            break
    return best


def begun_warm(evidence: Evidence, proof: Proof, before: Proof) -> tuple[Evidence, Proof]:
    """Each run's fluid as warm at its start as a model that heats it finds, and that fitted to them.

    Runs that were made one after the other begin with what the last one left, which no file tells.
    before: the model without the effects, which must do worse though each run had a scale of its own: else
    any error of the runs would be a warmth. The same where nothing is left that they could take, and where a
    run had to begin colder than a fluid does, or the force to grow with warmth, or where a recovery of each
    run's own explains clearly more: then what fades or recovers as the runs go on is no warmth.
    """
    if not proof.fit.model.effects.warm or is_quiet(proof):
        return evidence, proof
    begins = [proof.fit.theta, *_warmths(evidence, proof.fit)]
    theta, by_k, _ = min((warm_starts(proof.fit, begin) for begin in begins), key=lambda one: one[2])
    if float(np.max(np.abs(by_k))) < WARM_K:
        return evidence, proof
    anew = evidence.each(partial(warmed, by_k=by_k))
    fit = replace(proof.fit, solution=replace(proof.fit.solution, theta=theta))
    there = settled(prove(fitted_to(anew.records, fit), anew.folds), anew.folds)
    earned = log_gain(proof, there) > len(anew.records) * np.log(there.independent)
    sound = earned and there.predicts_better_than(proof) and _is_plausible(there.fit)
    sound = sound and begin_as_fluids_do(there.fit) and thins_as_it_warms(there.fit)
    sound = sound and more_than_scales(before.fit, there.fit) and not recovers_instead(before.fit, there.fit)
    return (anew, there) if sound else (evidence, proof)


def _is_plausible(fit: JointFit) -> bool:
    """Whether each effect's parameters still describe it."""
    reach, values = ranges_of(fit.model.records), fit.effect_values
    return all(e.describes(values[e.name], reach) for e in fit.model.effects.chosen)


def _warmths(evidence: Evidence, fit: JointFit) -> list[Array]:
    """The vector with h = 1 and each effect on the temperature where no small step of a base leads to."""
    reach, found = ranges_of(evidence.records), []
    cold = without_temperature(fit)
    for effect in fit.model.effects.chosen:
        if effect.stage is Stage.TEMPERATURE and effect.far is not None:
            found += [fit.model.with_effect_at(cold, effect, values) for values in effect.far(reach)]
    return found


def centred(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """Strokes with the zeros that a model finds, and that fitted to them; of a model that acts at places.

    Those that were integrated first. Those that were measured may have a zero of each run's own, too: they
    are believed unless a model then takes most of what it left.
    """
    placed = [e for e in proof.fit.model.effects.chosen if "displacement" in e.needs]
    if not placed:
        return evidence, proof
    others = _beginnings(evidence, placed)
    derived = ["displacement_m" in evidence.campaign.runs[r.run].derived for r in evidence.full]
    if any(derived):
        both = zip(evidence.full, evidence.records, strict=True)
        whole = [len(r) / r.rate_hz > WHOLE * len(full) / full.rate_hz for full, r in both]
        evidence, proof = _centred(evidence, proof, others, derived, whole, FARTHEST)
    if all(derived) or is_quiet(proof) or evidence.budget(proof.fit).excess <= 0.0:
        return evidence, proof
    steady = [False] * len(derived)
    measured = [not d for d in derived]
    anew, there = _centred(evidence, proof, others, measured, steady, MEASURED, FIRST_LEFT)
    return (anew, there) if there.mean_square < MOST_LEFT * proof.mean_square else (evidence, proof)


def _centred(
    evidence: Evidence,
    proof: Proof,
    others: list[dict[str, tuple[float, ...]]],
    unknown: list[bool],
    whole: list[bool],
    farthest: float,
    most_left: float = np.inf,
) -> tuple[Evidence, Proof]:
    """Strokes moved and the model fitted in turn, each time within half as much, until none moves.

    The same where the first time, before a fit, leaves more of the mean square than `most_left`.
    """
    for number in range(PLACINGS):
        by_m = stroke_zeros(proof.fit.model, proof.fit.theta, unknown, whole, farthest / 2.0**number)
        if not by_m.any():
            break
        anew = evidence.each(partial(moved, by_m=by_m))
        if number == 0 and _moving_leaves(proof.fit, anew, evidence) > most_left:
            break
        centres_m = np.array(evidence.centres_m or np.zeros(len(unknown))) + np.abs(by_m).sum(axis=1)
        evidence = replace(anew, centres_m=tuple(centres_m.tolist()))
        proof = prove(fitted_to(evidence.records, proof.fit, others), evidence.folds)
    return evidence, proof


def _moving_leaves(fit: JointFit, moved_there: Evidence, before: Evidence) -> float:
    """What a fit leaves of strokes that were moved, as a share of the mean square that it left before."""
    left, was = (error_on(fit, evidence.records) ** 2 for evidence in (moved_there, before))
    return left / max(was, 1e-300)


def _beginnings(evidence: Evidence, chosen: Iterable[Effect]) -> list[dict[str, tuple[float, ...]]]:
    """Where a fit may begin each of these effects anew."""
    reach = ranges_of(evidence.records)
    return [{e.name: guess} for e in chosen for guess in e.starting_points(reach)]
