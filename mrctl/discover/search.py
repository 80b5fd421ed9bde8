"""Forward search over effects: look at all, fit the promising ones jointly, keep what the data bear out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.proof import Proof, chance, log_gain, prove
from mrctl.discover.race import HEAT, HEAT_TOLERANCE, TOLERANCE, raced, with_plain_lag
from mrctl.discover.robust import second_opinions
from mrctl.discover.screen import Look, Screen, looks, ranges_of
from mrctl.discover.tangent import Tangent
from mrctl.identify.batch import in_parallel
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointFit, JointModel
from mrctl.identify.penalties import weighed_as
from mrctl.model.effects.base import Effect, Stage, Vector

Array = NDArray[np.float64]
Folds = Sequence[tuple[int, ...]]

MOST_FITTED = 5
NEAR = 0.2  # of the best look's gain: looks below are not fitted, ...
HOPELESS = 3e-3  # ... nor those that take less of the square sum: far too little to be named
MOST_SECOND = 3  # fitted for each second opinion on the base
_DEAR = 0.4  # as NEAR, for effects on the motion: their fits race from several starts
_DEAR_TOGETHER = {Stage.MOTION, Stage.YIELD}  # no slope of theirs is known but by differences
_WINDING = (Stage.MOTION, Stage.TEMPERATURE)  # whose first look says little about where they end
CLOSE_TRIAL = 0.7  # of the best trial's gain, to be begun once more from its base
WORTH_MOVING = 0.5  # of the cost, a negative log-likelihood: less is the same fit
ITERATIONS = 20


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


@dataclass(frozen=True, eq=False)
class Level:
    """One round: the model it began with, what every candidate looked like, and those fitted, best first."""

    before: Proof
    tangent: Tangent
    looks: list[Look]
    trials: list[Trial]


def search_level(
    before: Proof,
    candidates: Sequence[Effect],
    folds: Folds,
    near: float = NEAR,
    done: Callable[[str], None] = lambda _: None,
    known: Proof | None = None,
) -> Level:
    """Look at every candidate beside the model, and fit those that take at least `near` of the best.

    known: the same model with one of the candidates, already proven: that one is not fitted again, and the
    base it leads to is opinion enough.
    """
    tangent = Tangent.of(before.fit)
    seen = looks(tangent, candidates)
    done("every candidate")
    best = seen[0].gain if seen else 0.0
    least = HOPELESS * float(tangent.residual @ tangent.residual)
    promising = [
        one
        for one in seen[:MOST_FITTED]
        if one.gain > max(least, (_DEAR if one.effect.stage is Stage.MOTION else near) * best)
        and one.free.any()
    ]
    own = [] if known is None else _known(before, known, seen)
    promising = [one for one in promising if one.effect.name not in {t.effect.name for t in own}]
    trials = own + in_parallel(partial(tried, before, tangent, folds), promising)
    done(", ".join(one.effect.name for one in promising))
    for other in [] if own else second_opinions(before.fit):
        frozen = Tangent.of(other, frozen=True)
        cheap = [c for c in candidates if c.stage not in _DEAR_TOGETHER]
        few = looks(frozen, cheap)[:MOST_SECOND]
        for trial in in_parallel(partial(tried, before, frozen, folds), few):
            same = next((t for t in trials if t.effect.name == trial.effect.name), None)
            if same is None or trial.proof.mean_square < same.proof.mean_square:
                trials = [t for t in trials if t is not same] + [trial]
        done("a second opinion")
    before, trials = _levelled(before, trials, folds)
    reach = ranges_of(before.fit.model)
    trials = [
        t
        for t in trials
        if t.effect.plausible is None or t.effect.plausible(t.fit.effect_values[t.effect.name], reach)
    ]
    trials.sort(key=lambda trial: -trial.score)
    return Level(before, tangent, seen, trials)


def _known(before: Proof, proof: Proof, seen: Sequence[Look]) -> list[Trial]:
    """The trial that a proven model is, its look among those seen."""
    names = {e.name for e in proof.fit.model.effects.chosen}
    names -= {e.name for e in before.fit.model.effects.chosen}
    return [_trial(before, one, proof) for one in seen if one.effect.name in names and one.free.any()]


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
    before = _again(before, there, folds)
    least = CLOSE_TRIAL * best.gain
    trials = in_parallel(lambda t: t if t is best else _from(t, there, least, folds), trials)
    colour = min(trials, key=lambda t: t.proof.mean_square).proof.colour
    return before, [_judged(before, t, colour) for t in trials]


def _from(trial: Trial, base: Array, least: float, folds: Folds) -> Trial:
    """The trial, begun once more from another base, if it is close enough to matter."""
    if trial.gain < least:
        return trial
    return replace(trial, proof=_again(trial.proof, base, folds))


def _again(proof: Proof, base: Array, folds: Folds) -> Proof:
    """The better of a fit and the same fit begun with another base."""
    fit, model = proof.fit, proof.fit.model
    theta = np.concatenate([base, fit.theta[base.size :]])
    other = model.fit(
        theta,
        penalties=fit.penalties,
        free=moving(fit),
        rounds=1,
        iterations=ITERATIONS,
        tolerance=TOLERANCE,
    )
    return prove(other, folds) if other.total < fit.total - WORTH_MOVING else proof


def _judged(before: Proof, trial: Trial, colour: Array) -> Trial:
    """The trial held against a model without it, its samples counted as all trials' are.

    The colour of what the best one leaves is nearest to the noise's.
    """
    proof = replace(trial.proof, colour=colour)
    gain = log_gain(before, proof)
    return replace(trial, proof=proof, gain=gain, chance=chance(gain, trial.parameters))


def tried(before: Proof, tangent: Tangent, folds: Folds, look: Look) -> Trial:
    """The joint fit of a model with one more effect, begun at a look."""
    return _trial(before, look, prove(grown(tangent, look), folds))


def _trial(before: Proof, look: Look, proof: Proof) -> Trial:
    gain = log_gain(before, proof)
    return Trial(look.effect, look, proof, gain, chance(gain, int(np.count_nonzero(look.free))))


def grown(before: Tangent, look: Look) -> JointFit:
    """A fit with one more effect, base and effects moving together, weights as they are.

    It begins where it costs least: with the base settled around the look, with the base as it was, with less
    of the effect, or hardly any; with the base fitted anew beside the effect as it looked; or at the first of
    these with a plain lag for the filter, some effects from all their starting points.
    """
    fit = before.fit
    effect = look.effect
    alone = Effects((effect,))
    model = fit.model.with_effects(Effects((*fit.model.effects.chosen, effect)))
    own, neutral = alone.pack({effect.name: look.values}), alone.pack({effect.name: effect.neutral})
    starts = [
        np.concatenate([look.settled, own]),
        np.concatenate([fit.theta, own]),
        np.concatenate([fit.theta, 0.7 * neutral + 0.3 * own]),
        np.concatenate([fit.theta, 0.98 * neutral + 0.02 * own]),
    ]
    few = before.few.with_effects(model.effects)
    heat, fitted = (
        partial(
            on.fit,
            penalties=weighed_as(fit.penalties, model.penalties()),
            free=np.concatenate([moving(fit), look.free]),
            rounds=1,
        )
        for on in (few, model)
    )
    start = min(starts, key=model.cost)
    again, settled = [start], []
    stages = {e.stage for e in model.effects.chosen}
    if not stages >= _DEAR_TOGETHER:
        beside = np.concatenate([moving(fit), np.zeros(own.size, dtype=bool)])
        settled = [heat(starts[1], free=beside, iterations=HEAT, tolerance=HEAT_TOLERANCE).theta]
        if effect.stage in _WINDING:
            points = effect.starting_points(ranges_of(model))
            again += [np.concatenate([fit.theta, alone.pack({effect.name: point})]) for point in points]
    return raced([start, *settled, *(with_plain_lag(model, one) for one in again)], heat, fitted, ITERATIONS)


def grown_by(fit: JointFit, effect: Effect, values: Vector | None = None) -> JointFit:
    """A fit with one more effect, begun at given values (SI) or where a look finds that it takes most."""
    model = JointModel(fit.model.layout, fit.model.records, fit.model.effects, minimum_phase=True)
    model.weights, model.noise_n = fit.model.weights, fit.model.noise_n
    lag = model.fit(fit.theta, penalties=fit.penalties, rounds=1, iterations=ITERATIONS, tolerance=TOLERANCE)
    tangent = Tangent.of(lag)
    screen = Screen(tangent)
    if values is None:
        _, start = max(screen.glance(effect), key=lambda one: one[0])
        look = screen.climb(effect, start)
    else:
        look = screen.at(effect, values)
    return grown(tangent, look)


def without(proof: Proof, name: str, folds: Folds) -> Proof:
    """The same model less one effect, fitted anew from where it stands."""
    fit = proof.fit
    chosen = fit.model.effects.chosen
    rest = tuple(e for e in chosen if e.name != name)
    keep = np.concatenate(
        [np.ones(fit.model.layout.size, dtype=bool)]
        + [np.full(len(e.parameters), e.name != name) for e in chosen]
    )
    model = fit.model.with_effects(Effects(rest))
    smaller = model.fit(
        fit.theta[keep],
        penalties=weighed_as(fit.penalties, model.penalties()),
        free=moving(fit)[keep],
        rounds=1,
        iterations=ITERATIONS,
        tolerance=TOLERANCE,
    )
    return prove(smaller, folds)


def moving(fit: JointFit) -> NDArray[np.bool_]:
    """What moves in the next fit: the base, and of the effects what moved or stood at a bound."""
    lower, upper = fit.model.bounds()
    free = ~fit.solution.held | (fit.theta <= lower) | (fit.theta >= upper)
    free[: fit.model.layout.size] = True
    return free & fit.model.free()
