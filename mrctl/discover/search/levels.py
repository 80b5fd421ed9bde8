"""Forward search over effects: look at all, fit the promising ones jointly, keep what the data bear out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.grow import DEAR_TOGETHER, ITERATIONS, Folds, grown
from mrctl.discover.fits.proof import Proof, chance, log_gain, prove
from mrctl.discover.fits.race import CLOSE, near_cost
from mrctl.discover.fits.robust import second_opinions
from mrctl.discover.fits.screen import Look, reach_of
from mrctl.discover.fits.settle import again
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.fits.thinning import thins_as_it_warms
from mrctl.discover.search.looks import looks, usual_looks
from mrctl.discover.search.quiet import is_quiet
from mrctl.discover.verdict.worth import least_n2
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.plain_lags import with_lag_of_two
from mrctl.identify.processes import in_processes
from mrctl.model.effects.base import Effect, Stage

Array = NDArray[np.float64]

MOST_FITTED = 5
NEAR = 0.2  # of the best look's gain: looks below are not fitted, ...
HOPELESS = 0.3  # ... nor those that take less than this share of what it takes to be named
ENOUGH = 0.01  # of the mean square, that a trial may leave for its base to be believed
MORE_HEATS = 4  # for starts of a trial that may still become its best
MOST_SECOND = 3  # fitted for each second opinion on the base
_DEAR = 0.4  # as NEAR, for effects on the motion: their fits race from several starts
ABOUT = 0.9  # of the best look's gain, that another's is about as much


@dataclass(frozen=True, eq=False)
class Trial:
    """A model with one more effect, fitted jointly and proven."""

    effect: Effect
    look: Look
    proof: Proof
    gain: float  # twice the log-likelihood ratio to the model without it
    chance: float  # that an effect without meaning gains as much

    @property
    def parameters(self) -> int:
        """How many of the effect's own parameters the data could move."""
        return int(np.count_nonzero(self.look.free))

    @property
    def score(self) -> float:
        """Twice the log-likelihood ratio less what its parameters must earn (BIC); higher is better."""
        return self.gain - self.parameters * float(np.log(self.proof.independent))

    @property
    def fit(self) -> JointFit:
        """The joint fit."""
        return self.proof.fit

    @property
    def gain_at_most(self) -> float:
        """The gain, had a fit that was ended early gone on as it did last."""
        ended = self.fit.solution
        return self.gain + (0.0 if ended.converged else 2.0 * ITERATIONS * ended.last_gain)


@dataclass(frozen=True, eq=False)
class Level:
    """One round: the model it began with, what every candidate looked like, and those fitted, best first."""

    before: Proof
    whole: float  # the square sum that it left, in units of the noise
    looks: list[Look]
    trials: list[Trial]


def search_level(
    before: Proof,
    candidates: Sequence[Effect],
    folds: Folds,
    near: float = NEAR,
    done: Callable[[str], None] = lambda _: None,
    known: Proof | None = None,
    *,
    afar: bool = False,
) -> Level:
    """Look at every candidate beside the model, and fit those that take at least `near` of the best.

    afar: look at each from afar, once close looks and other bases have been asked; known: the same model with
    one of the candidates, already proven: that one is not fitted again, and the base it leads to is opinion
    enough, as is that of a trial with which nothing is left, or next to nothing.
    """
    tangent = Tangent.of(before.fit)
    whole = float(tangent.residual @ tangent.residual)
    n2 = max(before.mean_square, 1e-300)
    least = HOPELESS * least_n2(before) / n2 * whole
    taken, added = 0.0, None
    if known is not None:
        taken, added = (before.mean_square - known.mean_square) / n2 * whole, _added(before, known)
    seen = looks(tangent, candidates, afar=afar, least=max(least, min(near, _DEAR) * taken), sure=added)
    done("every candidate")
    hopeful = [one for one in seen[:MOST_FITTED] if one.gain > least and one.free.any()]
    own = [one for one in seen if one.effect.name == added and one.free.any()]
    trials = [] if known is None else [trial_of(before, one, known) for one in own]
    best = seen[0].gain if seen else 0.0
    while True:
        names = {t.effect.name for t in trials}
        promising = [
            one
            for one in hopeful
            if one.gain > (_DEAR if one.effect.stage is Stage.MOTION else near) * best
            and one.effect.name not in names
        ]
        if not promising:
            break
        trials = _raced(before, tangent, folds, promising, trials)
        done(", ".join(one.effect.name for one in promising))
        # A look that its fit does not bear out must not keep others from being fitted.
        best = max((before.mean_square - t.proof.mean_square) / n2 * whole for t in trials)
    told = afar or bool(own) or any(t.proof.mean_square < ENOUGH * n2 or is_quiet(t.proof) for t in trials)
    for other in [] if told else second_opinions(before.fit):
        frozen = Tangent.of(other, frozen=True)
        cheap = [c for c in candidates if c.stage not in DEAR_TOGETHER]
        rest = float(frozen.residual @ frozen.residual)
        seen_there = [one for one in looks(frozen, cheap) if one.gain > NEAR * rest and one.acts_rarely]
        few = seen_there[:MOST_SECOND]
        for trial in _all_tried(before, frozen, folds, few):
            same = next((t for t in trials if t.effect.name == trial.effect.name), None)
            if same is None or trial.proof.mean_square < same.proof.mean_square:
                trials = [t for t in trials if t is not same] + [trial]
        done("a second opinion")
    before, trials = _levelled(before, trials, folds)
    reach = reach_of(before.fit.model)
    trials = [t for t in trials if t.effect.describes(t.fit.effect_values[t.effect.name], reach)]
    trials = [t for t in trials if thins_as_it_warms(t.fit)]
    trials.sort(key=lambda trial: -trial.score)
    return Level(before, whole, seen, trials)


def further(level: Level, candidates: Sequence[Effect], folds: Folds) -> Level:
    """The round in which nothing was found, with those looked at from afar too that were not, nor fitted.

    A base may have made up for an effect in a way that no small step shows: for the loop of a field by its
    tables and its filter.
    """
    fitted = {t.effect.name for t in level.trials}
    rest = [c for c in candidates if c.name not in fitted and (c.far is None or c.stage is Stage.TEMPERATURE)]
    more = search_level(level.before, rest, folds, afar=True)
    seen = {one.effect.name: one for one in sorted([*level.looks, *more.looks], key=lambda one: one.gain)}
    trials = [*more.trials, *(_judged(more.before, t, t.proof.colour) for t in level.trials)]
    return replace(
        more,
        looks=sorted(seen.values(), key=lambda one: -one.gain),
        trials=sorted(trials, key=lambda trial: -trial.score),
    )


def unsearched(before: Proof, candidates: Sequence[Effect]) -> Level:
    """The round of a model beside which there is nothing to find: what candidates usually do, no fits."""
    tangent = Tangent.of(before.fit)
    whole = float(tangent.residual @ tangent.residual)
    return Level(before, whole, usual_looks(tangent, candidates), [])


def _added(before: Proof, proof: Proof) -> str | None:
    """The name of the effect that a model has more than another, if any."""
    were = {e.name for e in before.fit.model.effects.chosen}
    return next((e.name for e in proof.fit.model.effects.chosen if e.name not in were), None)


def _levelled(before: Proof, trials: list[Trial], folds: Folds) -> tuple[Proof, list[Trial]]:
    """The same fits, none of them in a worse valley than the best one's base leads to.

    A base has more than one valley. A trial that found a better one by luck would be credited with it; so
    the model without it, and the close trials, begin there once more.
    """
    if not trials:
        return before, trials
    best = min(trials, key=lambda t: t.proof.mean_square)
    size = before.fit.model.layout.size
    there = best.fit.theta[:size]
    close = [
        t
        for t in trials
        if t is not best and (t.gain >= CLOSE * best.gain or t.look.gain >= CLOSE * best.look.gain)
    ]
    common = [one for p in (before, *(t.proof for t in close)) for one in (p, *p.fit.model.common)]
    known = near_cost(before.fit.total, best.fit.total)
    asked = [(before, np.inf), *((t.proof, known) for t in close)]
    before, *proofs = in_processes(lambda one: again(one[0], there, folds, one[1]), asked, common)
    if best.effect.stage is Stage.OUTPUT:
        before = again(before, with_lag_of_two(before.fit.model, there), folds)
    begun = [replace(t, proof=proof) for t, proof in zip(close, proofs, strict=True)]
    trials = begun + [t for t in trials if t not in close]
    colour = min(trials, key=lambda t: t.proof.mean_square).proof.colour
    return before, [_judged(before, t, colour) for t in trials]


def _judged(before: Proof, trial: Trial, colour: Array) -> Trial:
    """The trial held against a model without it, its samples counted as all trials' are.

    The colour of what the best one leaves is nearest to the noise's.
    """
    proof = replace(trial.proof, colour=colour)
    gain = log_gain(before, proof)
    return replace(trial, proof=proof, gain=gain, chance=chance(gain, trial.parameters))


def _all_tried(
    before: Proof, tangent: Tangent, folds: Folds, seen: Sequence[Look], best: JointFit | None = None
) -> list[Trial]:
    common = [*seen, *(one.effect for one in seen), *before.fit.model.common]
    # What takes longest first, so that nothing waits for it.
    dear = sorted(seen, key=lambda one: len(one.effect.parameters), reverse=True)
    return in_processes(partial(tried, before, tangent, folds, best=best), dear, common)


def _raced(
    before: Proof, tangent: Tangent, folds: Folds, seen: Sequence[Look], trials: Sequence[Trial]
) -> list[Trial]:
    """These trials and those of more looks, which go no farther than to where they cannot come near the best.

    Where there is none yet, of those that promise about as much the cheapest goes first.
    """
    if not trials:
        best = max(one.gain for one in seen)
        close = [one for one in seen if one.gain >= ABOUT * best]
        first = min(close, key=lambda one: len(one.effect.parameters))
        trials, seen = [tried(before, tangent, folds, first)], [one for one in seen if one is not first]
    true = [t for t in trials if t.proof.predicts_better_than(before)]
    known = min((t.fit for t in true), key=lambda fit: fit.total, default=None)
    return [*trials, *_all_tried(before, tangent, folds, seen, known)]


def tried(before: Proof, tangent: Tangent, folds: Folds, look: Look, best: JointFit | None = None) -> Trial:
    """The joint fit of a model with one more effect, begun at a look; best: as `grown` has it."""
    return trial_of(before, look, prove(grown(tangent, look, MORE_HEATS, best), folds))


def trial_of(before: Proof, look: Look, proof: Proof) -> Trial:
    """The trial that a proven model with one more effect is, beside the model without it."""
    gain = log_gain(before, proof)
    return Trial(look.effect, look, proof, gain, chance(gain, int(np.count_nonzero(look.free))))
