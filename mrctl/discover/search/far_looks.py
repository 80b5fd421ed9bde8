"""A look at effects from afar: what no tangent of a base shows that has gone where it makes up for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.grow import without_temperature
from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE, heated_on, heats_of, pursued
from mrctl.discover.fits.sample import as_all_say
from mrctl.discover.fits.screen import Look, Screen
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import Penalty, weighed_as
from mrctl.model.effects.base import Effect, Stage, Vector

Array = NDArray[np.float64]
T = TypeVar("T")

KEPT = 0.5  # of what a few records promised, with which no other start is tried
MORE_HEATS = 2  # for starts that promise nothing yet, but would if they went on as they did last
SAME = 1e-6  # of a cost, that two starts may be apart and be one, ...
SAME_END = 0.5  # ... and a log-likelihood, that two ends may be
FAINT = 0.1  # of the best gain: what a few records promise less of is not gone on with
_KNOWN_FORCE = (Stage.ADDITIVE, Stage.ROD)  # which hangs on no other parameter
WINDING, FEWEST_TO_WIND = 0.1, 3  # of h, that it goes back on its way; over so many knots


@dataclass(frozen=True, eq=False)
class Promise:
    """An effect beside the model on a few records, after a few joint steps from one of its far points."""

    effect: Effect
    theta: Array
    gain: float  # on all records, that this promises


def far_points(
    screen: Screen, candidates: Sequence[Effect], others: Mapping[str, Sequence[Vector]] | None = None
) -> list[tuple[Effect, Sequence[Vector]]]:
    """The far points of those that have any; others: by name, of those that have none.

    A fluid's warmth only where h winds; and none where nothing may settle beside them.
    """
    if screen.tangent.frozen:
        return []
    winding = winds(screen.tangent.fit)
    own = {
        c.name: c.far(screen.ranges)
        for c in candidates
        if c.far is not None and (winding or c.stage is not Stage.TEMPERATURE)
    }
    return [(c, points) for c in candidates if (points := {**(others or {}), **own}.get(c.name))]


def promises(screen: Screen, effect: Effect, points: Sequence[Vector]) -> list[Promise]:
    """What a few joint steps from an effect's far points promise, by a few records; most first.

    A damper behind a dashpot yields at a speed in proportion to its force. A base without it has the mean of
    its knees in g; from there each small step towards a dashpot makes matters worse, until g is as sharp as
    behind one. No tangent shows that. Nor that of a base which has a friction's knee in its g, or g blunt for
    a spring before what yields, or which has bent its h to and fro for a warmth that the case does not show.
    """
    fit = screen.tangent.fit
    warm = effect.stage is Stage.TEMPERATURE
    few = screen.tangent.few(effect)
    alone = Effects((effect,))
    base = without_temperature(fit) if warm else fit.theta
    hold = () if few is fit.model else (as_all_say(fit, np.append(base, alone.pack({})), warmth=not warm),)
    heat = _heat(fit, few, effect, hold)
    starts = [np.concatenate([base, alone.pack({effect.name: effect.within(point)})]) for point in points]
    model = few.with_effects(Effects((*fit.model.effects.chosen, effect)))
    starts = _unlike(starts, model.cost, lambda cost: SAME * cost)
    if warm or effect.stage in _KNOWN_FORCE:  # the base settles beside it first
        settle = _heat(fit, few, effect, hold, beside=True)
        starts = [one.theta for one in heats_of(settle, starts)]
    # A few records are fitted better by any model than all are.
    least = screen.tangent.glance(effect).left_alone
    heats = heats_of(heat, starts)
    for _ in range(MORE_HEATS):
        heats = heated_on(heat, heats, lambda one: one.promised < least < one.total)
    ends = _unlike(heats, lambda one: one.total, lambda _: SAME_END)
    return [Promise(effect, one.theta, 2.0 * fit.total * (least - one.total) / least) for one in ends]


def _unlike(these: Sequence[T], cost: Callable[[T], float], same: Callable[[float], float]) -> list[T]:
    """Those that do not cost the same as another, by how little costs may be apart; the cheapest first.

    What tells far points apart may not act in this campaign, or be cut off at one bound.
    """
    costs = [cost(one) for one in these]
    kept: list[tuple[float, T]] = []
    for k in np.argsort(costs, kind="stable"):
        if not kept or costs[k] - kept[-1][0] > same(costs[k]):
            kept.append((costs[k], these[k]))
    return [one for _, one in kept]


def far_look(screen: Screen, worth: Sequence[Promise]) -> Look | None:
    """What one of an effect's promises, the best first, keeps on all records; None where none gains.

    One is gone on with after another until one keeps enough: to all records a start that a few made may be
    lost, or far at first.
    """
    if not worth:
        return None
    fit, effect = screen.tangent.fit, worth[0].effect
    heat = _heat(fit, fit.model, effect)
    best = fit
    for one in worth:
        further = pursued(heat, one.theta, 2 * HEAT, best.total)
        best = further if further.total < best.total else best
        if 2.0 * (fit.total - further.total) >= KEPT * one.gain:
            break
    if best is fit:
        return None
    look = screen.at(effect, best.effect_values[effect.name])
    return replace(look, gain=2.0 * (fit.total - best.total), settled=best.theta[: fit.theta.size])


def _heat(
    fit: JointFit, on: JointModel, effect: Effect, hold: Sequence[Penalty] = (), *, beside: bool = False
) -> Callable[..., JointFit]:
    """How a few steps are fitted with one more effect, on a model's records; beside: the effect as it is.

    What is optional of it stays where it began: so early it would lead into any valley.
    """
    model = on.with_effects(Effects((*fit.model.effects.chosen, effect)))
    own = [needed and not beside for needed in effect.needed]
    return partial(
        model.fit,
        penalties=[*weighed_as(fit.penalties, model.penalties()), *hold],
        rounds=1,
        free=np.concatenate([fit.moving, own]),
        iterations=HEAT,
        tolerance=HEAT_TOLERANCE,
        passing=True,
    )


def winds(fit: JointFit) -> bool:
    """Whether a base's h goes to and fro over the case's temperatures, as no fluid's does."""
    warmest = max(float(r.temperature_c.max()) for r in fit.model.records)
    seen = fit.model.layout.temperature_c <= warmest
    if np.count_nonzero(seen) < FEWEST_TO_WIND:
        return False
    tables = (h[seen] for h in (fit.tables.h_on, fit.tables.h_off))
    return any(float(np.abs(np.diff(h)).sum() - np.ptp(h)) > WINDING for h in tables)
