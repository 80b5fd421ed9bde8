"""Which physical effect is missing: search, verdict, and what stands behind it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.constancy import Change, changes_of
from mrctl.discover.evidence import Evidence
from mrctl.discover.exchange import exchanged
from mrctl.discover.grow import settled, without
from mrctl.discover.next_run import NextRun, propose
from mrctl.discover.own_delay import is_filters, why_own
from mrctl.discover.proof import Proof
from mrctl.discover.reveal import hidden_effects, taken_up
from mrctl.discover.rivals import simplest
from mrctl.discover.screen import ranges_of
from mrctl.discover.search import Level, Trial, search_level
from mrctl.discover.structure import Structure, structure_of
from mrctl.discover.verdict import NAMING, Balance, Found, Judged, judged_by
from mrctl.discover.worth import LEAST_SCORE, accepted, matters
from mrctl.measurements.run import Campaign
from mrctl.model.effects.base import Effect, Stage
from mrctl.model.effects.registry import effects

Array = NDArray[np.float64]
Report = Callable[[float, str], None]

MOST_EFFECTS = 4
_TIMED = (Stage.CURRENT, Stage.OUTPUT)  # effects that change when the force answers a step of the current
BETTER_VALLEY = 10.0  # log-likelihood that a model may win by beginning at the base of one with an effect
EVENED = 4  # times that the runs' scales are taken: the first time the tables have made up for some
CLOSE = 0.6  # of the best look's gain, to be fitted as a rival


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The verdict and everything that it stands on; mean squares in N² at the rate of the search."""

    verdict: str
    effects: tuple[str, ...]
    found: list[Found]
    base: Proof
    final: Proof
    first: Level
    balance: Balance
    structure: Structure
    left: Structure
    removable: float
    changes: list[Change]  # of effects that cannot be the ones missing, since their sizes are not constant
    hidden: dict[str, str]  # effects that this campaign cannot show, and why
    next_run: NextRun | None
    evidence: Evidence
    seconds: float
    levels: list[Level] = field(default_factory=list)


def diagnose(
    campaign: Campaign,
    known: Sequence[Effect] = (),
    values: dict[str, tuple[float, ...]] | None = None,
    report: Report = lambda _share, _what: None,
) -> Diagnosis:
    """What is missing from the base model with the known effects. Raises InputError for unusable runs."""
    began = time.monotonic()
    evidence = Evidence.of(campaign)
    report(0.05, "base model")
    base = evidence.base(known, values)
    evidence = evidence.steadied(base.fit).zeroed(base.fit).synchronised(base.fit)
    evidence = evidence.timed(evidence.stepless(base.fit))
    base = evidence.base(known, base.fit.effect_values, base.fit)
    for _ in range(EVENED):
        even = evidence.evened(base.fit)
        if even is evidence:
            break
        evidence, base = even, even.base(known, base.fit.effect_values, base.fit)
    structure = structure_of(base.fit, evidence.folds)
    candidates, untestable = evidence.candidates(known)
    report(0.3, "candidates")
    levels, found, last = _search(evidence, base, candidates, report)
    base, final = levels[0].before, levels[-1].before  # in the best valleys that the search came by
    untestable |= why_own(final, [t.effect.name for t in found], known)
    stands = [(found[0], last)] if len(found) == 1 and last is not None else []
    if found and not stands:
        stands, final = _confirmed(evidence, candidates, [t.effect for t in found], final, last)
    evidence, final, stands = _retimed(evidence, final, stands)
    evidence, final = evidence.rezeroed(final)
    judged = judged_by(evidence, base, final, stands)
    changes, constant = _constant(evidence, judged)
    if changes:
        without_them = judged_by(evidence, base, *constant, judged.removable)
        judged = without_them if without_them.verdict in NAMING else judged.unexplained()
    if judged.verdict == "unexplained":
        evidence = evidence.as_measured()
    final, left, balance, named = judged.final, judged.left, judged.balance, judged.found
    verdict, named_effects, removable = judged.verdict, judged.effects, judged.removable
    colour = float(np.median(final.colour))
    hidden = {**untestable, **hidden_effects(levels[0].looks, colour)}
    hidden = taken_up(hidden, final.fit.model.layout, final.fit.tables)
    proposal = _proposal(named, colour) if verdict == "ambiguous" else None
    report(1.0, verdict)
    return Diagnosis(
        verdict,
        named_effects,
        named,
        base,
        final,
        levels[0],
        balance,
        structure,
        left,
        removable,
        changes,
        {name: why for name, why in hidden.items() if name not in named_effects},
        proposal,
        evidence,
        time.monotonic() - began,
        levels,
    )


def _search(
    evidence: Evidence, base: Proof, candidates: list[Effect], report: Report
) -> tuple[list[Level], list[Trial], Level | None]:
    """The rounds, the effects found, and the round in which the last was; None where it took one's place."""
    here = base
    found: list[Trial] = []
    levels: list[Level] = []
    last: Level | None = None
    gone: set[str] = set()
    most = MOST_EFFECTS
    for number in count():
        rest = [c for c in candidates if c.name not in {e.name for e in here.fit.model.effects.chosen}]
        level = search_level(here, rest, evidence.folds)
        good = [t for t in level.trials if accepted(t, level.before, len(rest))]
        if not good and here.fit.total - level.before.fit.total > BETTER_VALLEY:
            # What was seen beside the worse fit says little: once more from the better one.
            level = search_level(level.before, rest, evidence.folds)
            good = [t for t in level.trials if accepted(t, level.before, len(rest))]
        levels.append(level)
        report(min(0.4 + 0.15 * number, 0.9), ", ".join(t.effect.name for t in found) or "one effect")
        here = level.before
        best = _best(evidence, level, good)
        if best is None or number == most:
            break
        if is_filters(best):
            here, most = settled(best.proof, evidence.folds), most + 1
            if not found:
                levels.clear()  # the base is another
            continue
        if found and not matters(evidence, base, here, best):
            instead = None if best.effect.name in gone else exchanged(here, best, found, evidence.folds)
            if instead is None:
                break
            here, needless = settled(instead[0], evidence.folds), instead[1]
            gone.add(needless.effect.name)
            found, last = [*(t for t in found if t is not needless), best], None
            continue
        here, last = settled(best.proof, evidence.folds), level
        found.append(best)
    return levels, found, last


def _best(evidence: Evidence, level: Level, good: Sequence[Trial]) -> Trial | None:
    """The effect to add: the simplest of the best that the runs bear out to their ends."""
    while good:
        best = simplest(good[0], level, good)
        if evidence.bears_out(best.fit, level.before.fit):
            return best
        good = [t for t in good if t is not best]
    return None


def _confirmed(
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


def _retimed(
    evidence: Evidence, final: Proof, stands: list[tuple[Trial, Level]]
) -> tuple[Evidence, Proof, list[tuple[Trial, Level]]]:
    """The steps' times taken anew with effects that bear on them; one that then vanishes was only that."""
    timed = [e for e in final.fit.model.effects.chosen if e.stage in _TIMED]
    if not timed:
        return evidence, final, stands
    anew, there = evidence.retimed(final)
    reach = ranges_of(there.fit.model)
    values = there.fit.effect_values
    gone = [e.name for e in timed if e.plausible is not None and not e.plausible(values[e.name], reach)]
    if not gone:
        return anew, there, stands
    return _retimed(
        evidence,
        without(final, gone[0], evidence.folds),
        [(trial, level) for trial, level in stands if trial.effect.name != gone[0]],
    )


def _constant(
    evidence: Evidence, judged: Judged
) -> tuple[list[Change], tuple[Proof, list[tuple[Trial, Level]]]]:
    """The effects named whose sizes change with conditions, and the model without them.

    One that has rivals is not asked: it may be any of them, and the next run decides.
    """
    final, stands = judged.final, judged.stands
    sure = {f.trial.effect.name for f in judged.found if not f.rivals}
    changes: list[Change] = []
    while stands and judged.verdict in NAMING:
        chosen = [trial.effect for trial, _ in stands if trial.effect.name in sure]
        certain = [c for c in changes_of(final.fit, chosen) if c.certain]
        if not certain:
            break
        changes.append(certain[0])
        final = without(final, certain[0].effect, evidence.folds)
        stands = [(trial, level) for trial, level in stands if trial.effect.name != certain[0].effect]
    return changes, (final, stands)


def _proposal(named: list[Found], colour: float) -> NextRun | None:
    """The next run for the first effect that has rivals."""
    known = effects()
    for one in named:
        if one.rivals:
            rivals = [known[r.name] for r in one.rivals]
            other = any(r.other_current for r in one.rivals)
            return propose(one.trial.fit, one.trial.effect, rivals, colour, other_current=other)
    return None
