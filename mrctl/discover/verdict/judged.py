"""The verdict on a search: whether its effects explain what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.proof import Proof, log_gain
from mrctl.discover.search.levels import Level, Trial
from mrctl.discover.verdict.balance import Balance, balance_of
from mrctl.discover.verdict.courses import Course, courses_of
from mrctl.discover.verdict.rivals import CLOSE_SCORE, Rival, rivals_of
from mrctl.discover.verdict.structure import Structure, structure_of
from mrctl.discover.verdict.worth import AT_END, at_high_end, is_unsure
from mrctl.identify.processes import in_processes
from mrctl.model.effects.base import FORCE_LAG, Effect

Array = NDArray[np.float64]

SEEN = 0.02  # of what is left, that a course must be which effects stand in place of
EXPLAINED = 0.9  # of what can be removed: less, and the effects found are not what is missing
NEARLY_ALL = 0.98  # of that: more, and an effect at its end, or of a wide spread, is not doubted for it; ...
MOST_IN_PART = 2  # ... nor are more effects than so many, which could make up for anything
FORESEEN = 0.6  # of what they take off held-out data and what is missed there that the fit did not miss
MANY_FOLDS = 4
OVERHEAD = 1.1  # held-out over in-sample mean square of a sound model: what its own freedom costs
AS_MUCH = 0.97  # of what the effects take, that one course takes without them, if it is seen beside them too
MOSTLY, HALF = 0.6, 0.5  # of what the effects leave unsaid, and of what they take: that they stand in for
AS_LITTLE = 1.03  # times what they leave, that it may leave, where they leave but noise
NEARLY_AS_GOOD, MOST_OTHERS = 0.7, 2  # of the gain of an effect found, and how many such others are kept
NAMING = ("found", "ambiguous")  # verdicts that name effects


@dataclass(frozen=True, eq=False)
class Found:
    """An effect that belongs into the model, and its rivals."""

    trial: Trial
    rivals: list[Rival]
    others: list[Effect] = field(default_factory=list)  # that took nearly as much at its place, best first


@dataclass(frozen=True, eq=False)
class Judged:
    """A model, the effects in it with the rounds that they stand in, and the verdict on it."""

    final: Proof
    stands: list[tuple[Trial, Level]]
    left: Structure
    balance: Balance
    found: list[Found]
    removable: float
    verdict: str
    effects: tuple[str, ...]
    courses: Sequence[Course]  # that no effect has, of what the base leaves; most first
    stranger: Course | None = None  # the one that says more than the effects in the model

    def unexplained(self) -> Judged:
        """The same model, of which no effect can be named."""
        return replace(self, verdict="unexplained", effects=())


def judged_by(
    evidence: Evidence,
    base: Proof,
    final: Proof,
    stands: list[tuple[Trial, Level]],
    known_n2: float = 0.0,
) -> Judged:
    """The verdict on a model beside the base it grew from.

    known_n2: the mean square that can be removed at least, if another model has shown so.
    """
    left = structure_of(final.fit, evidence.folds)
    alone = [(base, final.colour)] if final is not base else []
    beside, *of_base = in_processes(lambda left_by: courses_of(*left_by), [(final, None), *alone])
    balance = balance_of(evidence, final, left, beside, bare=not stands)
    removable = max(known_n2, base.mean_square - final.mean_square + balance.left)
    found = [Found(trial, rivals_of(trial, level), _nearly_as_good(trial, level)) for trial, level in stands]
    courses = of_base[0] if of_base else beside
    cleared = balance.cleared and not known_n2
    if not found:
        cleared = cleared and not balance.bursts
    verdict, effects = _verdict(base, final, found, removable, cleared=cleared)
    little = cleared or balance.left < (1.0 - NEARLY_ALL) * removable
    unsaid = np.inf if little else balance.left
    instead = stranger(base, final, stands, courses, beside, unsaid, cleared=cleared) if found else None
    judged = Judged(final, stands, left, balance, found, removable, verdict, effects, courses, instead)
    return judged.unexplained() if instead is not None else judged


def stranger(
    base: Proof,
    final: Proof,
    stands: Sequence[tuple[Trial, Level]],
    alone: Sequence[Course],
    beside: Sequence[Course],
    unsaid_n2: float = np.inf,
    *,
    cleared: bool = False,
) -> Course | None:
    """A course that no effect has, which says more of what is missing than the effects named; None if none.

    alone, beside: the courses of what the base leaves, and the final model. It takes more without the effects
    than they do, and they have more parameters; or it is still seen beside them, and takes about as much; or
    it is most of what they leave unsaid, and takes half as much as they do: they stand in for it.
    unsaid_n2: the mean square that they leave over the noise, infinite where that is next to nothing.
    cleared: the effects leave but noise, so a course that leaves more is not better for its fewer parameters,
    or for where it takes it; of a large error, a course that takes nearly all may leave far more.
    """
    names = {trial.effect.name for trial, _ in stands}
    gain = log_gain(base, final)
    taken = base.mean_square - final.mean_square
    seen = {c.words for c in beside if c.certain and c.share > SEEN}
    unsaid = {c.words for c in beside if c.certain and c.share * final.mean_square > MOSTLY * unsaid_n2}
    for course in alone:
        if not course.certain or course.alike & names:
            continue
        leaves = (1.0 - course.share) * base.mean_square
        as_little = leaves < AS_LITTLE * final.mean_square
        as_much = as_little if cleared else course.share * base.mean_square > AS_MUCH * taken
        better = course.gain > gain + CLOSE_SCORE and (as_much or not cleared)
        stood_in = course.words in unsaid and course.share * base.mean_square > HALF * taken
        if better or stood_in or (course.words in seen and as_much):
            return course
    return None


def _nearly_as_good(chosen: Trial, level: Level) -> list[Effect]:
    """The effects that took most of what the chosen one did, and were true held out."""
    return [
        t.effect
        for t in level.trials
        if t.effect.name != chosen.effect.name
        and t.gain > NEARLY_AS_GOOD * chosen.gain
        and t.proof.predicts_better_than(level.before)
    ][:MOST_OTHERS]


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
    if not cleared and (explained < EXPLAINED or (explained < NEARLY_ALL and _doubted(named, final))):
        return "unexplained", ()
    if _foreseen(base, final) < FORESEEN or any(_relaxes(f.trial.effect, final) for f in named):
        return "unexplained", ()
    names = [f.trial.effect.name for f in named]
    rivals = [r.name for f in named for r in f.rivals]
    if rivals:
        return "ambiguous", tuple(dict.fromkeys([*names, *rivals]))
    return "found", tuple(names)


def _doubted(named: list[Found], final: Proof) -> bool:
    """Whether effects may have made up for what they are not: by their number, or by where they ended."""
    return len(named) > MOST_IN_PART or _imitates(named, final)


def _imitates(named: list[Found], final: Proof) -> bool:
    """Whether an effect is at the end of what is physical, or of no size that the runs agree on."""
    spread = final.fit.effect_std()
    return any(_bent(f.trial.effect, final) or is_unsure(f.trial.effect, final.fit, spread) for f in named)


def _bent(effect: Effect, final: Proof) -> bool:
    """Whether a fit has pushed an effect to the end of what is physical: then it imitates something else.

    At the low end of a partial parameter only that part is not there: a mount's damping, say.
    """
    return any(
        not p.held
        and p.unit != "1"  # which say what form it has, and end where another form begins
        and min(np.inf if p.partial else value - p.low, np.inf if p.endless else p.high - value)
        < AT_END * (p.high - p.low)
        and abs(value - p.neutral) > AT_END * (p.high - p.low)
        for p, value in zip(effect.parameters, final.fit.effect_values[effect.name], strict=True)
    )


def _relaxes(effect: Effect, final: Proof) -> bool:
    """Whether a force follows as late as any may: then it is an elastic one that relaxes, which none is.

    However little is left with it: a bushing of rubber is a spring and a damper that come late, for a band.
    """
    values = final.fit.effect_values[effect.name]
    return any(
        p.name == FORCE_LAG.name and at_high_end(p, value)
        for p, value in zip(effect.parameters, values, strict=True)
    )


def _foreseen(base: Proof, final: Proof) -> float:
    """What the effects take off held-out data, of that and what they then miss there that the fit did not.

    Of many folds the one that the effects do worst in is not asked: a run may be alone in where it goes.
    """
    before, after, counts = base.held_out, final.held_out, final.fold_counts
    if counts.size >= MANY_FOLDS:
        kept = np.arange(counts.size) != int(np.argmax((after - before) / counts))
        before, after, counts = before[kept], after[kept], counts[kept]
    size = float(counts.sum())
    taken = float((before - after).sum()) / size
    missed = max(float(after.sum()) / size - OVERHEAD * final.mean_square, 0.0)
    return taken / (taken + missed) if taken > 0.0 else 0.0
