"""The rounds of a search: in each, all that may come to a model is looked at, the best that is real stays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from itertools import count

from mrctl.discover import taken_anew
from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.proof import Proof
from mrctl.discover.fits.settle import settled
from mrctl.discover.search.begun_warm import begun_warm
from mrctl.discover.search.exchange import exchanged
from mrctl.discover.search.levels import Level, Trial, further, search_level, unsearched
from mrctl.discover.search.quiet import is_quiet
from mrctl.discover.search.renewed import renewed
from mrctl.discover.verdict.judged import EXPLAINED, MOST_IN_PART, NEARLY_ALL
from mrctl.discover.verdict.own_delay import is_filters
from mrctl.discover.verdict.rivals import simplest
from mrctl.discover.verdict.scales import is_the_rigs
from mrctl.discover.verdict.worth import accepted, least_accepted_n2, matters, removable_n2, stands_in
from mrctl.model.effects.base import Effect

Report = Callable[[float, str], None]

MOST_EFFECTS = 4
BETTER_VALLEY = 10.0  # log-likelihood that a model may win by beginning at an effect's base; as much, ...
WORTH_ANOTHER = 0.25  # ... and this share of what an effect must take, and it is searched once more
MUCH_MORE = 4.0  # of what the last effect took, that one found later may take


def rounds_of(
    evidence: Evidence, base: Proof, candidates: list[Effect], report: Report
) -> tuple[Evidence, list[Level], list[Trial], Level | None, Proof]:
    """The rounds, the effects found, the round in which the last was, and the model with them.

    That round is None where the last one took another's place. The evidence comes with them, since the runs'
    zeros and scales show only when what is larger has been found.
    """
    here = base
    found: list[Trial] = []
    levels: list[Level] = []
    last: Level | None = None
    gone: set[str] = set()
    most = MOST_EFFECTS
    # Asked for more than once of a model beside which a round is searched.
    rezeroed, quiet = cache(taken_anew.rezeroed), cache(is_quiet)
    for number in count():
        rest = [c for c in candidates if c.name not in {e.name for e in here.fit.model.effects.chosen}]
        full = number == most
        level, good = (unsearched(here, rest), []) if full else _round(evidence, here, rest, quiet)
        report(min(0.4 + 0.15 * number, 0.9), ", ".join(t.effect.name for t in found) or "one effect")
        here = level.before
        there, level, best = _chosen(evidence, level, good, [] if full or quiet(here) else rest)
        levels.append(level)
        if best is None:
            break
        even, clean = rezeroed(evidence, here) if found else (evidence, here)
        if even is not evidence and is_the_rigs(best, clean):
            evidence, here, most = even, clean, most + 1
            continue
        if is_filters(best):
            here, most = settled(best.proof, evidence.folds), most + 1
            if not found:
                levels.clear()  # the base is another
            continue
        alike = bool(found) and stands_in(best, levels[0], found)
        if found and not matters(there, base, here, best, stands_in=alike):
            instead = None if best.effect.name in gone else exchanged(here, best, found, evidence.folds)
            if instead is None:
                break
            here, needless = settled(instead[0], evidence.folds), instead[1]
            gone.add(needless.effect.name)
            found, last = [*(t for t in found if t is not needless), best], None
            continue
        evidence, here, last = there, settled(best.proof, there.folds), level
        # Or what comes next makes up for it.
        evidence, here = taken_anew.centred(*taken_anew.stepped(*taken_anew.remembered(evidence, here)))
        evidence, here = taken_anew.begun_warm(evidence, here, level.before)
        found.append(best)
        if len(found) > 1 and evidence.budget(here.fit).excess > 0.0:
            here = renewed(here, [t.effect for t in found], evidence.folds)
        zeroed = rezeroed(evidence, here)
        evidence, here = zeroed if quiet(zeroed[1]) else (evidence, here)
        if quiet(here) or _hopeless(evidence, levels[0].before, level.before, here, len(found)):
            break
    return evidence, levels, found, last, here


def _round(
    evidence: Evidence, here: Proof, rest: Sequence[Effect], quiet: Callable[[Proof], bool]
) -> tuple[Level, list[Trial]]:
    """A look at all that may come to a model, and those that are real; quiet: as `is_quiet`.

    From afar too, where none is and so much is left over any noise that one may be named.
    """
    if quiet(here):
        return unsearched(here, rest), []
    level = search_level(here, rest, evidence.folds)
    good = _accepted(level, len(rest))
    if not good and _is_another(here, level):
        # What was seen beside the worse fit says little: once more from the better one.
        return _round(evidence, level.before, rest, quiet)
    if not good and evidence.budget(level.before.fit).excess > least_accepted_n2(level.before):
        level = further(level, rest, evidence.folds)
        good = _accepted(level, len(rest))
    return level, good


def _is_another(here: Proof, level: Level) -> bool:
    """Whether the valley that a round has led its model to is so much better that effects may show there."""
    least = 0.5 * level.whole * least_accepted_n2(level.before) / level.before.mean_square
    return here.fit.total - level.before.fit.total > max(BETTER_VALLEY, WORTH_ANOTHER * least)


def _chosen(
    evidence: Evidence, level: Level, good: Sequence[Trial], rest: Sequence[Effect]
) -> tuple[Evidence, Level, Trial | None]:
    """The effect to add, if any, and the runs and the round that it was found in.

    Where none is good, a warmth that the runs begin with is asked; rest: the candidates for that.
    """
    best = _best(evidence, level, good)
    warm = begun_warm(evidence, level, rest) if best is None else None
    if warm is None:
        return evidence, level, best
    return warm[0], replace(level, trials=[warm[1], *level.trials]), warm[1]


def _accepted(level: Level, candidates: int) -> list[Trial]:
    """The trials that are real."""
    return [t for t in level.trials if accepted(t, level.before, candidates)]


def _hopeless(evidence: Evidence, base: Proof, before: Proof, here: Proof, found: int) -> bool:
    """Whether no more effects can explain what is missing, if none takes much more than the last.

    So many that they are doubted for their number alone must explain nearly all.
    """
    taken, last = (was.mean_square - here.mean_square for was in (base, before))
    needed = EXPLAINED if found < MOST_IN_PART else NEARLY_ALL
    return taken + (MOST_EFFECTS - found) * MUCH_MORE * last < needed * removable_n2(evidence, base, here)


def _best(evidence: Evidence, level: Level, good: Sequence[Trial]) -> Trial | None:
    """The effect to add: the simplest of the best that the runs bear out to their ends."""
    while good:
        best = simplest(good[0], level, good)
        if evidence.bears_out(best.fit, level.before.fit):
            return best
        good = [t for t in good if t is not best]
    return None
