"""When an effect is worth naming: beyond chance, beyond what tables leave, and more than a patch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtri

from mrctl.discover.fits.elsewhere import elsewhere
from mrctl.discover.fits.finer_tables import finer_score
from mrctl.discover.fits.proof import Proof
from mrctl.discover.verdict.constancy import Change, changes_of
from mrctl.identify.joint_fit import NORMAL_95, half_width_95
from mrctl.model.effects.base import Effect, Parameter, Vector

if TYPE_CHECKING:
    from mrctl.discover.evidence import Evidence
    from mrctl.discover.search.levels import Level, Trial
    from mrctl.identify.joint_fit import JointFit

SIGNIFICANCE = 0.01  # over all candidates together
LEAST_SCORE = 10.0  # BIC
LEAST_OF_FORCE = 1e-3  # in RMS of the force's: less may be tables that are straight between knots
SMALL_OF_FORCE = 5e-4  # as LEAST_OF_FORCE, of an effect that says more than finer tables would
LEAST_SHARE = 0.05  # of the mean square that an effect must take off, ...
LOUD_SHARE, LOUD_OF_FORCE = 0.01, 2e-3  # ... or this, where it is that much of the force, ...
LATER_SHARE = 0.04  # ... and of what all take off: less may be the first one's form that is not quite so, ...
LATER_LEFT = 0.6  # or of what is still left over the noise, ...
LATER_LEAST = 0.025  # ... if it is at least this share of all, ...
NEARLY_ALL, NEARLY_ALL_LEAST = 0.9, 0.01  # ... or this where it is that much of what is left, ...
# ... or this where data left out are foretold so many times better over the noise, and with it, ...
FORETOLD, FORETOLD_AT_ALL, FORETOLD_LEAST = 4.0, 2.0, 0.01
LATER_CLEARING = 0.004  # ... or this where with it nothing but noise is left; ...
STEADY_LEFT = 0.3  # ... or this much of what is left, if at all conditions it has one size, ...
STEADY, STEADY_SIGNALS = 0.1, 4  # ... which is to say to this share, over so many signals; ...
ELSEWHERE = 0.3  # ... each takes this much, relative to all, where those found before are silent, ...
MOSTLY_ELSEWHERE = 0.7  # ... and this much will do in place of a share of all, ...
MOSTLY_SILENT = 0.75  # ... or of what is left over the noise, where they are silent so much of the time

STANDS_IN = 0.95  # of what an effect took alone, that another did
PUSHED_SHARE = 0.1  # of what all take off, that one at the end of physics or of no sure size must take
UNLIKE = 0.05  # chance that sizes which are none together lie so, ...
ALIKE = 1e-6  # ... where their correlation tells them apart better than this
AT_END = 1e-6  # of a parameter's range


def accepted(trial: Trial, before: Proof, candidates: int) -> bool:
    """Whether an effect is real: beyond chance, worth its parameters, worth naming, and true held out."""
    return (
        trial.chance * candidates < SIGNIFICANCE
        and trial.score > LEAST_SCORE
        and trial.proof.predicts_better_than(before)
        and _is_more_than_form(trial, before)
    )


def _is_more_than_form(trial: Trial, before: Proof) -> bool:
    """Whether an effect takes more than the form of tables may, or a fair share that finer ones would not."""
    taken = before.mean_square - trial.proof.mean_square
    if taken > least_n2(before):
        return True
    return taken > _fair_n2(before) and trial.score > finer_score(before, trial.proof.colour)


def least_accepted_n2(before: Proof) -> float:
    """The mean square in N² without which no effect is accepted, whatever its score."""
    return min(least_n2(before), _fair_n2(before))


def _fair_n2(before: Proof) -> float:
    """The same of an effect that says more than finer tables would."""
    return max(LEAST_SHARE * before.mean_square, SMALL_OF_FORCE**2 * force_n2(before))


def least_n2(before: Proof) -> float:
    """The mean square in N² that an effect must take off a model to be worth naming."""
    force, left = force_n2(before), before.mean_square
    loud = max(LOUD_SHARE * left, LOUD_OF_FORCE**2 * force)
    return max(min(LEAST_SHARE * left, loud), LEAST_OF_FORCE**2 * force)


def removable_n2(evidence: Evidence, base: Proof, here: Proof) -> float:
    """The mean square in N² that could be taken off a base: what a model takes, and leaves over the noise."""
    return base.mean_square - here.mean_square + evidence.budget(here.fit).excess


def matters(evidence: Evidence, base: Proof, here: Proof, best: Trial, *, stands_in: bool = False) -> bool:
    """Whether a later effect is more than a patch on the form of an earlier one.

    It takes a fair share of all that was taken; or a small one that is most of what is left over the noise;
    or nothing but noise is left with it and more was without; or it has one size at all conditions, as no
    patch has. Where the earlier ones are silent at times, a small one must act there too, unless it takes
    most of what is left and data left out are foretold far better; where they mostly are (a stop), what it
    takes there is judged by itself. And where nothing but noise may be left, it must not have another size
    at other conditions; nor may a small one be the largest that physics allows, or of no size told from none.
    What is next to nothing of all, and little of what is left, is no effect.
    stands_in: as `stands_in` says, and a fair share of all must do.
    """
    taken = here.mean_square - best.proof.mean_square
    every = base.mean_square - best.proof.mean_square
    before, after = evidence.budget(here.fit), evidence.budget(best.fit)
    foretold = _foretold(here, best.proof, after.noise)
    little = taken < min(LATER_CLEARING * every, LEAST_SHARE * here.mean_square)
    if little or (taken < PUSHED_SHARE * every and _of_no_size(best, foretold=foretold)):
        return False
    # What it takes may have passed for noise: then what is left with it tells the noise better.
    certain = before.excess > LEAST_OF_FORCE**2 * force_n2(here) or before.judged > after.most_noise
    changes = changes_of(best.fit, [best.effect])
    if not certain and any(change.certain for change in changes):
        return False
    fair = taken > LATER_SHARE * every
    if fair or stands_in:
        return fair
    left = before.total - after.noise
    # Not what it takes right after steps of the current, where a budget does not look.
    aside = min(taken, before.total - after.total)
    most = aside > LATER_LEFT * left
    cleared = after.excess <= 0.0 and after.judged <= before.most_noise
    small = LATER_CLEARING if certain and cleared else FORETOLD_LEAST
    if most and taken > small * every and foretold:
        return True
    found = {e.name for e in here.fit.model.effects.chosen} - {e.name for e in base.fit.model.effects.chosen}
    beside = elsewhere(here, best.proof, found)
    if beside is not None and beside.to_all < ELSEWHERE:
        return False
    apart = beside is not None and beside.to_all > MOSTLY_ELSEWHERE
    reasons = (
        apart and beside is not None and beside.samples > MOSTLY_SILENT and beside.of_left > LEAST_SHARE,
        aside > NEARLY_ALL * left > 0.0 and taken > NEARLY_ALL_LEAST * every,
        most and ((certain and apart) or taken > LATER_LEAST * every),
        certain and aside > STEADY_LEFT * left and are_steady(changes),
        certain and cleared and not most and taken > LATER_CLEARING * every,
    )
    return any(reasons)


def stands_in(later: Trial, first: Level, found: Sequence[Trial]) -> bool:
    """Whether alone, in the first round, a later effect took nearly all that one which was found did.

    So it is much the same, as a spring in series with the fluid is like one in the mount, and what little it
    takes beside the other may be that one's form: a rubber's that creeps, say.
    """
    taken = {t.effect.name: first.before.mean_square - t.proof.mean_square for t in first.trials}
    most = max((taken.get(one.effect.name, 0.0) for one in found), default=0.0)
    return most > 0.0 and taken.get(later.effect.name, 0.0) > STANDS_IN * most


def _foretold(before: Proof, after: Proof, noise_n2: float) -> bool:
    """Whether data left out are foretold far better, over the noise: a patch mends what was seen."""
    was, now = before.held_out_mean_square, after.held_out_mean_square
    return max(now - noise_n2, 0.0) * FORETOLD < was - noise_n2 and now * FORETOLD_AT_ALL < was


def _of_no_size(trial: Trial, *, foretold: bool) -> bool:
    """Whether an effect's size is no finding: the largest that physics allows, or not told from none.

    foretold: data left out are foretold far better with it, so that it is there, whatever the runs that it
    shows in leave open of its form: a stop that few of them touch.
    """
    effect, fit = trial.effect, trial.fit
    if is_pushed(effect, fit.effect_values[effect.name]):
        return True
    if foretold:
        return False
    spread = fit.effect_std()
    return is_unsure(effect, fit, spread) and not _told_together(effect, fit, spread[effect.name])


def _told_together(effect: Effect, fit: JointFit, spread: Vector) -> bool:
    """Whether sizes that could each be none for the others' sake cannot be none together.

    A change of the force with the current and with its square trade with each other, for one.
    """
    values, size = fit.effect_values[effect.name], _sizes(effect, spread)
    if len(size) < 2:
        return False
    off = np.array([(values[k] - effect.parameters[k].neutral) / half_width_95(spread[k]) for k in size])
    alike = fit.effect_correlation(effect.name)[np.ix_(size, size)]
    inverse = np.linalg.pinv(alike, rcond=ALIKE, hermitian=True)
    return bool(NORMAL_95**2 * float(off @ inverse @ off) > chdtri(len(size), UNLIKE))


def is_pushed(effect: Effect, values: Sequence[float]) -> bool:
    """Whether a fit has gone to the upper end of what is physical for an effect, by its parameters (SI).

    Not in what is optional of its form, as the speed at which a friction's breakaway has gone: that says
    nothing of how much there is.
    """
    asked = [
        (p, value)
        for p, value in zip(effect.parameters, values, strict=True)
        if p.unit != "1" and not (p.held or p.endless or p.optional) and p.neutral < p.high
    ]
    return any(at_high_end(p, value) for p, value in asked)


def is_stretched(effect: Effect, values: Sequence[float]) -> bool:
    """Whether a fit has bent an effect as far as its form goes, by its parameters (SI).

    Of what can go both ways: where a range ends at the neutral value, its other end is a form of its own.
    """
    return any(
        p.low < p.neutral < p.high
        and not p.held
        and min(value - p.low, p.high - value) < AT_END * (p.high - p.low)
        for p, value in zip(effect.parameters, values, strict=True)
    )


def at_high_end(parameter: Parameter, value: float) -> bool:
    """Whether a value (SI) is the largest that a parameter may have."""
    return parameter.high - value < AT_END * (parameter.high - parameter.low)


def is_size(parameter: Parameter) -> bool:
    """Whether a parameter says how much of an effect there is: a typical effect has another value than none.

    The rest are shapes, which have no value without an effect.
    """
    return parameter.typical != parameter.neutral and not parameter.partial


def is_nothing(effect: Effect, values: Sequence[float]) -> bool:
    """Whether all sizes of an effect, by its parameters (SI), are those without one.

    So must be what a force is in proportion to, in a typical one or not: an asymmetry may be the current's
    alone.
    """
    return all(
        abs(value - p.neutral) <= AT_END * (p.high - p.low)
        for p, value in zip(effect.parameters, values, strict=True)
        if is_size(p) or (p.linear and not p.optional)
    )


def is_unsure(effect: Effect, fit: JointFit, spread: Mapping[str, Vector]) -> bool:
    """Whether by its spread (SI) each size that a fit moved may as well be the one without an effect."""
    values, std = fit.effect_values[effect.name], spread[effect.name]
    told = [
        abs(values[k] - effect.parameters[k].neutral) > half_width_95(std[k]) for k in _sizes(effect, std)
    ]
    return bool(told) and not any(told)


def _sizes(effect: Effect, spread: Sequence[float]) -> list[int]:
    """Which of the parameters that a fit moved say how much of an effect there is; all, where none does."""
    moved = [k for k, std in enumerate(spread) if std > 0.0]
    return [k for k in moved if is_size(effect.parameters[k])] or moved


def are_steady(changes: Sequence[Change]) -> bool:
    """Whether an effect is known to have one size wherever the campaign went."""
    return len(changes) >= STEADY_SIGNALS and all(c.size + 2.0 * c.error < STEADY for c in changes)


def force_n2(proof: Proof) -> float:
    """The measured force's mean square."""
    return float(np.mean(np.concatenate([r.force_n for r in proof.fit.model.records]) ** 2))
