"""Channels taken anew with a model that has been found, and the model fitted to what comes of it.

What a base without its effects had made up for, by other zeros, times or places, shows only then.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np

from mrctl.discover.base_fit import fitted_to
from mrctl.discover.channels.field_past import fields_past
from mrctl.discover.channels.stroke_zeros import FARTHEST, moved, stroke_zeros
from mrctl.discover.evidence import WHOLE, Evidence
from mrctl.discover.fits.proof import Proof, prove
from mrctl.discover.fits.screen import ranges_of
from mrctl.model.effects.base import Effect, Stage

PASTS = 3  # times that the runs' pasts are taken: a model has made up for some
PLACINGS = 6  # as PASTS, of the strokes' zeros: a stop's place and theirs go together


def retimed(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """The steps' times taken anew with a model that has been found, and the model fitted to them.

    A model without the coil's lag put part of it into the times: so it is fitted to the currents as they
    were measured first.
    """
    plain = evidence.of_records(evidence.measured)
    evidence = plain.timed(fitted_to(plain.records, proof.fit))
    return evidence, prove(fitted_to(evidence.records, proof.fit), evidence.folds)


def stepped(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """The steps' times taken anew with a spring in series, which answers them late; the same if no better.

    A base without it put the spring's own time into the steps'.
    """
    if not any(e.stage is Stage.MOTION for e in proof.fit.model.effects.chosen):
        return evidence, proof
    anew, there = retimed(evidence, proof)
    return (anew, there) if there.mean_square < proof.mean_square else (evidence, proof)


def rezeroed(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """The runs' zeros and scales taken anew with a model that has been found, and that fitted to them."""
    anew = evidence.zeroed(proof.fit).evened(proof.fit)
    if anew is evidence:
        return evidence, proof
    return anew, prove(fitted_to(anew.records, proof.fit), anew.folds)


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
    return evidence, proof


def centred(evidence: Evidence, proof: Proof) -> tuple[Evidence, Proof]:
    """Strokes that were integrated with the zeros that a model finds, and that fitted to them.

    Such a model acts at places of the stroke.
    """
    unknown = ["displacement_m" in evidence.campaign.runs[r.run].derived for r in evidence.full]
    both = zip(evidence.full, evidence.records, strict=True)
    whole = [len(r) / r.rate_hz > WHOLE * len(full) / full.rate_hz for full, r in both]
    placed = [e for e in proof.fit.model.effects.chosen if "displacement" in e.needs]
    others = _beginnings(evidence, placed)
    for number in range(PLACINGS if placed and any(unknown) else 0):
        within = FARTHEST / 2.0**number
        by_m = stroke_zeros(proof.fit.model, proof.fit.theta, unknown, whole, within)
        if not by_m.any():
            break
        centres_m = np.array(evidence.centres_m or np.zeros(len(unknown))) + np.abs(by_m).sum(axis=1)
        evidence = replace(evidence.each(partial(moved, by_m=by_m)), centres_m=tuple(centres_m.tolist()))
        proof = prove(fitted_to(evidence.records, proof.fit, others), evidence.folds)
    return evidence, proof


def _beginnings(evidence: Evidence, chosen: Iterable[Effect]) -> list[dict[str, tuple[float, ...]]]:
    """Where a fit may begin each of these effects anew."""
    reach = ranges_of(evidence.records)
    return [{e.name: guess} for e in chosen for guess in e.starting_points(reach)]
