"""Which physical effect is missing: search, verdict, and what stands behind it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover import taken_anew
from mrctl.discover.base_fit import fitted_to
from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.proof import Proof
from mrctl.discover.search.levels import Level
from mrctl.discover.search.reveal import hidden_effects, taken_up
from mrctl.discover.search.rounds import Report, rounds_of
from mrctl.discover.verdict.balance import Balance
from mrctl.discover.verdict.constancy import Change
from mrctl.discover.verdict.courses import Course
from mrctl.discover.verdict.judged import NAMING, Found, Judged, judged_by
from mrctl.discover.verdict.next_run import NextRun, propose
from mrctl.discover.verdict.own_delay import why_own
from mrctl.discover.verdict.scales import evened, scales_instead
from mrctl.discover.verdict.stands import by_rounds, confirmed, constant, in_vain, retimed
from mrctl.discover.verdict.structure import Structure, structure_of
from mrctl.discover.verdict.worth import accepted
from mrctl.identify.findings import steady
from mrctl.measurements.run import Campaign
from mrctl.model.effects.base import Effect
from mrctl.model.effects.registry import effects

Array = NDArray[np.float64]

SLIGHT = 0.1  # of the mean square that a base leaves: effects that take less and are not borne out are none
MOSTLY_THE_CLOCK = 0.5  # of what a base misses, that goes with an earlier current
AS_WELL = 1.05  # in what is left, of a diagnosis with more effects


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
    courses: Sequence[Course]  # that no effect has, of what the base leaves; most first
    stranger: Course | None  # the one that says more than the effects in the model
    seconds: float = 0.0  # that all of it took
    levels: list[Level] = field(default_factory=list)

    def rmse_n(self, mean_square: float) -> float:
        """The RMS error at the samples measured, in N, of a mean square in N² at the rate of the search."""
        return float(np.sqrt(max(mean_square, 0.0) + self._averaged_n2))

    @cached_property
    def _averaged_n2(self) -> float:
        return self.evidence.averaged_away_n2(self.final.fit)


def diagnose(
    campaign: Campaign,
    known: Sequence[Effect] = (),
    values: dict[str, tuple[float, ...]] | None = None,
    report: Report = lambda _share, _what: None,
) -> Diagnosis:
    """What is missing from the base model with the known effects. Raises InputError for unusable runs."""
    began = time.monotonic()
    evidence = Evidence.of(campaign)
    known = evidence.sized(known)
    report = _never_back(report)
    report(0.05, "base model")
    base = evidence.base(known, values)
    quiet = evidence.steadied(base.fit)
    evidence = quiet.resolved(base.fit)
    if evidence is not quiet:
        base = evidence.base(known, base.fit.effect_values, base.fit)
    search = partial(_mended, known=known, report=report)
    sharp = evidence.sharpened(base.fit)
    if sharp is evidence:
        found = search(evidence, base)
    else:
        found = search(sharp, sharp.base(known, base.fit.effect_values, base.fit))
        if found.verdict != "none":  # what is missing may have seemed to be smoothed away
            found = _better(search(evidence, base), found)
    report(1.0, found.verdict)
    return replace(found, seconds=time.monotonic() - began)


def _mended(evidence: Evidence, base: Proof, known: Sequence[Effect], report: Report) -> Diagnosis:
    """The diagnosis of runs without their own zeros, their currents in time, as far as a base shows these."""
    search = partial(_diagnosed, base=base, known=known, report=report)
    zeroed = evidence.zeroed(base.fit)
    if zeroed is evidence:  # a worse valley may hide them
        best = evidence.base(known, base.fit.effect_values, base.fit)
        search = partial(search, fitted=(evidence, best))
        zeroed = evidence.zeroed(best.fit)
    early = zeroed.synchronised(base.fit)
    found = search(zeroed) if early is zeroed else _of_either_clock(search, zeroed, early, base)
    if zeroed is not evidence and (found.found or found.verdict == "unexplained"):
        # What is missing may have seemed to be the runs' own zeros.
        found = _better(search(evidence), found)
    return found


def _of_either_clock(
    search: Callable[[Evidence], Diagnosis], plain: Evidence, early: Evidence, base: Proof
) -> Diagnosis:
    """The diagnosis of runs whose current seems late: it is, or what is missing makes it seem so.

    An earlier current that leaves most of what is missing is asked second; and not at all, where effects
    leave less without it than it takes.
    """
    here, there = (fitted_to(one.records, base.fit) for one in (plain, early))
    taken = 1.0 - there.total / here.total
    if taken > MOSTLY_THE_CLOCK:
        found = search(early)
        return _better(search(plain), found) if found.found else found
    found = search(plain)
    if found.verdict in NAMING and found.balance.left < taken * found.base.mean_square:
        return found
    return _better(found, search(early))


def _never_back(report: Report) -> Report:
    """Tells how far a diagnosis is, also where a part of it is done once more."""
    most = 0.0

    def told(share: float, what: str) -> None:
        nonlocal most
        most = max(most, share)
        report(most, what)

    return told


def _better(plain: Diagnosis, other: Diagnosis) -> Diagnosis:
    """The better explanation of two: of runs as they were measured, and of others."""
    return plain if _is_better(plain, other) else other


def _is_better(plain: Diagnosis, other: Diagnosis) -> bool:
    """Whether runs as measured explain as much with fewer effects, or more with no more of them.

    Any number explains more than what leaves the other unexplained.
    """
    if plain.verdict == "unexplained" or not {plain.verdict, other.verdict} & set(NAMING):
        return False
    if len(plain.found) < len(other.found):
        return plain.balance.total < AS_WELL * other.balance.total
    no_more = len(plain.found) == len(other.found) or other.verdict == "unexplained"
    return plain.verdict in NAMING and no_more and plain.balance.total < other.balance.total


def _diagnosed(
    evidence: Evidence,
    base: Proof,
    known: Sequence[Effect],
    report: Report,
    fitted: tuple[Evidence, Proof] | None = None,
) -> Diagnosis:
    """The diagnosis of runs whose channels are mended, but for what hangs on the base's fit to them.

    fitted: the base in its best valley, and to which evidence; to another it is fitted anew.
    """
    evidence = evidence.timed(evidence.stepless(base.fit))
    if fitted is not None and fitted[0] is evidence:
        base = fitted[1]
    else:
        base = evidence.base(known, base.fit.effect_values, base.fit)
    evidence, base = evened(evidence, base, known)
    structure = structure_of(base.fit, evidence.folds)
    candidates, untestable = evidence.candidates(known)
    report(0.3, "candidates")
    evidence, levels, found, last, final = rounds_of(evidence, base, candidates, report)
    base = levels[0].before  # in the best valley that the search came by, as the final model
    untestable |= why_own(final, [t.effect.name for t in found], known)
    stands = [(found[0], last)] if len(found) == 1 and last is not None else []
    as_found = final if stands or not found else None
    if found and not stands:
        if in_vain(evidence, base, final, len(found)):
            stands = by_rounds(found, levels)
        else:
            stands, final = confirmed(evidence, candidates, [t.effect for t in found], final, last)
    searched = evidence
    evidence, final, stands = retimed(evidence, final, stands)
    if final is not as_found:  # else the rounds have done so
        evidence, final = taken_anew.centred(*taken_anew.remembered(evidence, final))
        evidence, final = taken_anew.begun_warm(evidence, final, base)
    evidence, final = taken_anew.rezeroed(evidence, final)
    if final.mean_square > base.mean_square:
        # Effects that do worse with their own clocks and zeros than none with its are neither.
        evidence, final, stands = searched, base, []
    judged = judged_by(evidence, base, final, stands)
    changes, without_changes = constant(evidence, judged)
    if changes:
        without_them = judged_by(evidence, base, *without_changes, judged.removable)
        judged = without_them if without_them.verdict in NAMING else judged.unexplained()
    judged = _less_what_is_slight(evidence, base, judged)
    rig = scales_instead(searched, base, known, judged)
    if rig is not None:
        evidence, base, judged = rig
    elif judged.verdict == "unexplained":
        evidence = evidence.as_measured()
    final = judged.final
    colour = float(np.median(final.colour))
    unseen = hidden_effects(levels[0].looks, colour, steady=steady(evidence.records))
    hidden = taken_up({**untestable, **unseen}, final.fit.model.layout, final.fit.tables)
    # What would have been too little at its usual size, and was seen, is more than that.
    shown = {*judged.effects, *real_alone(levels[0])}
    return Diagnosis(
        verdict=judged.verdict,
        effects=judged.effects,
        found=judged.found,
        base=base,
        final=final,
        first=levels[0],
        balance=judged.balance,
        structure=structure,
        left=judged.left,
        removable=judged.removable,
        changes=changes,
        hidden={name: why for name, why in hidden.items() if name not in shown},
        next_run=_proposal(evidence, judged.found, colour) if judged.verdict == "ambiguous" else None,
        evidence=evidence,
        courses=judged.courses,
        stranger=judged.stranger,
        levels=levels,
    )


def real_alone(first: Level) -> list[str]:
    """The effects that the data bear out each by itself, beside the base; best first."""
    return [t.effect.name for t in first.trials if accepted(t, first.before, len(first.looks))]


def _less_what_is_slight(evidence: Evidence, base: Proof, judged: Judged) -> Judged:
    """The base alone, where all that it leaves may be noise and effects took a little that is not borne out.

    Nor is it where the noise of the motion makes as much. Else the verdict as it is.
    """
    taken = base.mean_square - judged.final.mean_square
    if not judged.stands or taken > SLIGHT * base.mean_square:
        return judged
    if judged.verdict in NAMING and not evidence.budget(base.fit).drowned:
        return judged
    alone = judged_by(evidence, base, base, [])
    return alone if alone.verdict == "none" else judged


def _proposal(evidence: Evidence, named: list[Found], colour: float) -> NextRun | None:
    """The next run for the first effect that has rivals."""
    known = effects()
    for one in named:
        if one.rivals:
            rivals = evidence.sized(known[r.name] for r in one.rivals)
            other = any(r.other_current for r in one.rivals)
            return propose(one.trial.fit, one.trial.effect, rivals, colour, other_current=other)
    return None
