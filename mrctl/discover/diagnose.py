"""Which physical effect is missing: search, verdict, and what stands behind it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.evidence import Evidence
from mrctl.discover.grow import settled, without
from mrctl.discover.lines import Line, hums_of, line_of
from mrctl.discover.next_run import NextRun, propose
from mrctl.discover.proof import Proof
from mrctl.discover.reveal import hidden_effects, taken_up
from mrctl.discover.rivals import Rival, rivals_of, simplest
from mrctl.discover.screen import ranges_of
from mrctl.discover.search import Level, Trial, search_level
from mrctl.discover.structure import Structure, structure_of
from mrctl.discover.worth import LEAST_OF_FORCE, LEAST_SCORE, accepted, force_n2, matters
from mrctl.measurements.run import Campaign
from mrctl.model.effects.base import Effect, Stage
from mrctl.model.effects.registry import effects

Array = NDArray[np.float64]
Report = Callable[[float, str], None]

MOST_EFFECTS = 4
_TIMED = (Stage.CURRENT, Stage.OUTPUT)  # effects that change when the force answers a step of the current
BETTER_VALLEY = 10.0  # log-likelihood that a model may win by beginning at the base of one with an effect
CLOSE = 0.6  # of the best look's gain, to be fitted as a rival
LEFT_OF_NOISE = 0.15  # of what is left, that maps may predict before it counts
EXPLAINED = 0.8  # of what can be removed: less, and the effects found are not what is missing
FORESEEN = 0.6  # of what they take off held-out data and what is missed there that the fit did not miss
OVERHEAD = 1.1  # held-out over in-sample mean square of a sound model: what its own freedom costs


@dataclass(frozen=True, eq=False)
class Found:
    """An effect that belongs into the model, and its rivals."""

    trial: Trial
    rivals: list[Rival]


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
    evidence = evidence.steadied(base.fit)
    evidence = evidence.timed(evidence.stepless(base.fit))
    base = evidence.base(known, base.fit.effect_values, base.fit)
    structure = structure_of(base.fit, evidence.folds)
    candidates, untestable = evidence.candidates(known)
    report(0.3, "candidates")
    levels, found = _search(evidence, base, candidates, report)
    base, final = levels[0].before, levels[-1].before  # in the best valleys that the search came by
    stands = [(found[0], levels[0])] if len(found) == 1 else []
    if len(found) > 1:
        stands, final = _confirmed(evidence, candidates, [t.effect for t in found], final, levels)
    evidence, final, stands = _retimed(evidence, final, stands)
    left = structure_of(final.fit, evidence.folds)
    balance = balance_of(evidence, final, left)
    removable = base.mean_square - final.mean_square + balance.left
    named = [Found(trial, rivals_of(trial, level, cleared=balance.cleared)) for trial, level in stands]
    verdict, named_effects = _verdict(base, final, named, removable, cleared=balance.cleared)
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
        {name: why for name, why in hidden.items() if name not in named_effects},
        proposal,
        evidence,
        time.monotonic() - began,
        levels,
    )


def _search(
    evidence: Evidence, base: Proof, candidates: list[Effect], report: Report
) -> tuple[list[Level], list[Trial]]:
    here = base
    found: list[Trial] = []
    levels: list[Level] = []
    for number in range(MOST_EFFECTS + 1):
        rest = [c for c in candidates if c.name not in {t.effect.name for t in found}]
        level = search_level(here, rest, evidence.folds)
        good = [t for t in level.trials if accepted(t, level.before, len(rest))]
        if not good and here.fit.total - level.before.fit.total > BETTER_VALLEY:
            # What was seen beside the worse fit says little: once more from the better one.
            level = search_level(level.before, rest, evidence.folds)
            good = [t for t in level.trials if accepted(t, level.before, len(rest))]
        levels.append(level)
        report(min(0.4 + 0.15 * number, 0.9), ", ".join(t.effect.name for t in found) or "one effect")
        here = level.before
        if not good or number == MOST_EFFECTS:
            break
        best = simplest(good[0], level, good)
        if found and not matters(evidence, base, here, best):
            break
        here = settled(best.proof, evidence.folds)
        found.append(best)
    return levels, found


def _confirmed(
    evidence: Evidence, candidates: list[Effect], chosen: list[Effect], final: Proof, levels: list[Level]
) -> tuple[list[tuple[Trial, Level]], Proof]:
    """Each effect as if it were the last one added, beside all that could stand in its place.

    One that the others made needless is dropped; one that another fits clearly better is exchanged.
    """
    last, found = levels[len(chosen) - 1], final
    stands: list[tuple[Trial, Level]] = []
    for effect in chosen:
        others = {e.name for e in final.fit.model.effects.chosen} - {effect.name}
        rest = [c for c in candidates if c.name not in others]
        if effect is chosen[-1] and final is found:
            level = last  # it was the last one added, and nothing has changed since
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


@dataclass(frozen=True, slots=True)
class Balance:
    """Mean squares in N² at full rate: the model's, the noise's, and what of the difference is certain."""

    total: float
    noise: float
    measured: bool  # the noise, from cycle to cycle
    left: float
    line: Line | None = None  # that stands out of the spectrum of what is left, and swells with the motion
    hums: Sequence[Line] = ()  # that do not: the measurement's own

    @property
    def cleared(self) -> bool:
        """Whether nothing but noise is left."""
        return self.left <= 0.0


def balance_of(evidence: Evidence, final: Proof, left: Structure) -> Balance:
    """What a model leaves over the noise, beyond the doubt about the noise and the form of its tables."""
    budget = evidence.budget(final.fit)
    structured = left.explained_n2 if left.significant and left.share > LEFT_OF_NOISE else 0.0
    rates = [r.rate_hz / r.finer for r in evidence.full]
    hums, errors = hums_of(evidence.steady_errors(final.fit), rates)
    line = line_of(errors, rates)
    shaken = 0.0 if line is None else line.mean_square_n2
    over = max(budget.excess, structured, shaken)
    counts = over > LEAST_OF_FORCE**2 * force_n2(final)
    return Balance(budget.total, budget.noise, budget.measured, over if counts else 0.0, line, hums)


def _verdict(
    base: Proof,
    final: Proof,
    named: list[Found],
    removable: float,
    *,
    cleared: bool,
) -> tuple[str, tuple[str, ...]]:
    if not named:
        return ("none", ()) if cleared else ("unexplained", ())
    explained = (base.mean_square - final.mean_square) / removable if removable > 0.0 else 0.0
    if (not cleared and explained < EXPLAINED) or _foreseen(base, final) < FORESEEN:
        return "unexplained", ()
    names = [f.trial.effect.name for f in named]
    rivals = [r.name for f in named for r in f.rivals]
    if rivals:
        return "ambiguous", tuple(dict.fromkeys([*names, *rivals]))
    return "found", tuple(names)


def _foreseen(base: Proof, final: Proof) -> float:
    """What the effects take off held-out data, of that and what they then miss there that the fit did not."""
    taken = base.held_out_mean_square - final.held_out_mean_square
    missed = max(final.held_out_mean_square - OVERHEAD * final.mean_square, 0.0)
    return taken / (taken + missed) if taken > 0.0 else 0.0


def _proposal(named: list[Found], colour: float) -> NextRun | None:
    """The next run for the first effect that has rivals."""
    known = effects()
    for one in named:
        if one.rivals:
            rivals = [known[r.name] for r in one.rivals]
            return propose(one.trial.fit, one.trial.effect, rivals, colour)
    return None
