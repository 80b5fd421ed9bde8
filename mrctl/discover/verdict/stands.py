"""Which of the effects found stand: beside all the others, beside the channels' clocks, at all conditions."""

from __future__ import annotations

from collections.abc import Sequence

from mrctl.discover import taken_anew
from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.proof import Proof
from mrctl.discover.fits.screen import reach_of
from mrctl.discover.fits.settle import without
from mrctl.discover.search.levels import Level, Trial, search_level
from mrctl.discover.verdict.constancy import Change, changes_of
from mrctl.discover.verdict.judged import EXPLAINED, MOST_IN_PART, NAMING, Judged
from mrctl.discover.verdict.rivals import simplest
from mrctl.discover.verdict.worth import LEAST_SCORE, accepted, removable_n2
from mrctl.model.effects.base import Effect, Stage

_TIMED = (Stage.CURRENT, Stage.OUTPUT)  # effects that change when the force answers a step of the current
CLOSE = 0.6  # of the best look's gain, to be fitted as a rival


def confirmed(
    evidence: Evidence, candidates: list[Effect], chosen: list[Effect], final: Proof, last: Level | None
) -> tuple[list[tuple[Trial, Level]], Proof]:
    """Each effect as if it were the last one added, beside all that could stand in its place.

    One that the others made needless is dropped; one that another fits clearly better is exchanged. last: the
    round in which the last one was found; None where it was none.
    """
    found = final
    stands: list[tuple[Trial, Level]] = []
    for effect in chosen:
        others = {e.name for e in final.fit.model.effects.chosen} - {effect.name}
        rest = [c for c in candidates if c.name not in others]
        if effect is chosen[-1] and final is found and last is not None:
            level = last  # nothing has changed since
        else:
            smaller = without(final, effect.name, evidence.folds)
            level = search_level(smaller, rest, evidence.folds, near=CLOSE, known=final)
        smaller = level.before
        good = [t for t in level.trials if accepted(t, smaller, len(rest))]
        if not good:
            final = smaller
            continue
        best = simplest(good[0], level, good)
        own = next((t for t in level.trials if t.effect.name == effect.name), None)
        keep = own is not None and own.score > best.score - LEAST_SCORE
        stands.append((own if keep and own is not None else best, level))
        if not keep:
            final = best.proof
    return stands, final


def in_vain(evidence: Evidence, base: Proof, final: Proof, found: int) -> bool:
    """Whether so many effects explain so little that asking each of them again would hardly name one.

    Only an exchange that took most of what is left could; the rounds try exchanges of their own.
    """
    taken = base.mean_square - final.mean_square
    return found > MOST_IN_PART and taken < EXPLAINED * removable_n2(evidence, base, final)


def by_rounds(found: Sequence[Trial], levels: Sequence[Level]) -> list[tuple[Trial, Level]]:
    """The effects found, each with the round that it was found in."""
    return [(trial, next(one for one in levels if trial in one.trials)) for trial in found]


def retimed(
    evidence: Evidence, final: Proof, stands: list[tuple[Trial, Level]]
) -> tuple[Evidence, Proof, list[tuple[Trial, Level]]]:
    """The steps' times taken anew with effects that bear on them; one that then vanishes was only that."""
    timed = [e for e in final.fit.model.effects.chosen if e.stage in _TIMED]
    if not timed:
        return evidence, final, stands
    anew, there = taken_anew.retimed(evidence, final)
    reach = reach_of(there.fit.model)
    values = there.fit.effect_values
    gone = [e.name for e in timed if not e.describes(values[e.name], reach)]
    if not gone:
        return anew, there, stands
    return retimed(
        evidence,
        without(final, gone[0], evidence.folds),
        [(trial, level) for trial, level in stands if trial.effect.name != gone[0]],
    )


def constant(
    evidence: Evidence, judged: Judged
) -> tuple[list[Change], tuple[Proof, list[tuple[Trial, Level]]]]:
    """The effects named whose sizes change with conditions, and the model without them.

    One that has rivals is not asked: it may be any of them, and the next run decides. Of what is not named
    anyhow only the first is told, and the model stays.
    """
    final, stands = judged.final, judged.stands
    sure = {f.trial.effect.name for f in judged.found if not f.rivals}
    changes: list[Change] = []
    while stands:
        chosen = [trial.effect for trial, _ in stands if trial.effect.name in sure]
        certain = [c for c in changes_of(final.fit, chosen) if c.certain]
        if not certain:
            break
        changes.append(certain[0])
        if judged.verdict not in NAMING:
            break
        final = without(final, certain[0].effect, evidence.folds)
        stands = [(trial, level) for trial, level in stands if trial.effect.name != certain[0].effect]
    return changes, (final, stands)
