"""A look at effects from afar: what no tangent of a base shows that has gone where it makes up for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.grow import without_temperature
from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE
from mrctl.discover.fits.screen import Look, Screen
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import weighed_as
from mrctl.identify.processes import in_processes
from mrctl.model.effects.base import Effect, Stage, Vector

Array = NDArray[np.float64]

KEPT = 0.5  # of what a few records promised, with which no other start is tried
FAINT = 0.1  # of the best look's gain: what a few records promise less of is not gone on with
_KNOWN_FORCE = (Stage.ADDITIVE, Stage.ROD)  # which hangs on no other parameter
WINDING, FEWEST_TO_WIND = 0.1, 3  # of h, that it goes back on its way; over so many knots


def far_looks(screen: Screen, candidates: Sequence[Effect], best: float) -> list[Look]:
    """Looks from the far points of those that have any, where these are worth it beside the best gain so far.

    A fluid's warmth only where h winds; and none where nothing may settle beside them.
    """
    fit = screen.tangent.fit
    if screen.tangent.frozen:
        return []
    winding = winds(fit)
    places = [
        (c, c.far(screen.ranges))
        for c in candidates
        if c.far is not None and (winding or c.stage is not Stage.TEMPERATURE)
    ]
    common = [*candidates, *fit.model.common]
    found = in_processes(lambda place: _far_look(screen, *place, FAINT * best), places, common)
    return [one for one in found if one is not None]


def _far_look(screen: Screen, effect: Effect, points: Sequence[Vector], worth: float) -> Look | None:
    """What a few joint steps from the effect's far points win; None where a few records promise less.

    A damper behind a dashpot yields at a speed in proportion to its force. A base without it has the mean of
    its knees in g; from there each small step towards a dashpot makes matters worse, until g is as sharp as
    behind one. No tangent shows that. Nor that of a base which has a friction's knee in its g, or which has
    bent its h to and fro for a warmth that the case does not show.
    """
    fit = screen.tangent.fit
    warm = effect.stage is Stage.TEMPERATURE
    few = screen.tangent.few(effect)
    alone, effects = Effects((effect,)), Effects((*fit.model.effects.chosen, effect))
    model = fit.model.with_effects(effects)
    joint, beside = (np.concatenate([fit.moving, own]) for own in (alone.free(), np.zeros(alone.size, bool)))
    heat = partial(
        JointModel.fit,
        penalties=weighed_as(fit.penalties, model.penalties()),
        rounds=1,
        iterations=HEAT,
        tolerance=HEAT_TOLERANCE,
    )
    own = few.with_effects(effects)
    base = without_temperature(fit) if warm else fit.theta
    starts = [np.concatenate([base, alone.pack({effect.name: effect.within(point)})]) for point in points]
    if warm or effect.stage in _KNOWN_FORCE:  # the base settles beside it first
        starts = [heat(own, start, free=beside).theta for start in starts]
    least = replace(fit, model=few).total
    won = [heat(own, start, free=joint) for start in starts]
    won = [one for one in won if _promised(fit, least, one) > worth]
    if few is not fit.model:
        won = _on_all(fit, least, won, partial(heat, model, iterations=2 * HEAT, tolerance=0.0, free=joint))
    best = min(won, key=lambda one: one.total, default=None)
    if best is None or best.total >= fit.total:
        return None
    look = screen.at(effect, best.effect_values[effect.name])
    return replace(look, gain=2.0 * (fit.total - best.total), settled=best.theta[: fit.theta.size])


def _on_all(
    fit: JointFit, least: float, won: Sequence[JointFit], further: Callable[[Array], JointFit]
) -> list[JointFit]:
    """Fits to a few records gone on with on all, the best first, until one keeps what the few promised.

    least: what the fit costs on the few. To all a start that a few made may be lost, or far at first.
    """
    found: list[JointFit] = []
    for one in sorted(won, key=lambda one: one.total):
        found.append(further(one.theta))
        if 2.0 * (fit.total - found[-1].total) >= KEPT * _promised(fit, least, one):
            break
    return found


def _promised(fit: JointFit, least: float, one: JointFit) -> float:
    """The gain on all records that a fit to a few of them promises, which cost `least` without the effect."""
    return 2.0 * fit.total * (least - one.total) / least


def winds(fit: JointFit) -> bool:
    """Whether a base's h goes to and fro over the case's temperatures, as no fluid's does."""
    warmest = max(float(r.temperature_c.max()) for r in fit.model.records)
    seen = fit.model.layout.temperature_c <= warmest
    if np.count_nonzero(seen) < FEWEST_TO_WIND:
        return False
    tables = (h[seen] for h in (fit.tables.h_on, fit.tables.h_off))
    return any(float(np.abs(np.diff(h)).sum() - np.ptp(h)) > WINDING for h in tables)
