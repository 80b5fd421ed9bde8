"""A look at every candidate beside one model, best first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.grow import without_temperature
from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE
from mrctl.discover.fits.screen import Look, Screen, ranges_of
from mrctl.discover.fits.tangent import Tangent
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import weighed_as
from mrctl.identify.processes import in_processes
from mrctl.model.effects.base import Effect, Stage, Vector

Array = NDArray[np.float64]

CLIMBED = 7
STARTS = 3  # from which an effect is looked at closely, ...
KEPT = 0.5  # ... until one gives so much of what the glance at a few records promised there
_KNOWN_FORCE = (Stage.ADDITIVE, Stage.ROD)  # which hangs on no other parameter
WINDING, FEWEST_TO_WIND = 0.1, 3  # of h, that it goes back on its way; over so many knots


def looks(tangent: Tangent, candidates: Sequence[Effect], most: int = CLIMBED) -> list[Look]:
    """All candidates, best first; only the `most` best of a first glance are looked at closely."""
    ranges = ranges_of(tangent.fit.model.records)
    whole = float(tangent.residual @ tangent.residual)

    parts = [tangent.glance(effect) for effect in candidates]
    few = {id(part): Screen(part, ranges) for part in parts}

    def glance(place: int) -> list[tuple[float, Vector]]:
        rest = parts[place].residual
        more = whole / max(float(rest @ rest), 1e-30)
        promised = few[id(parts[place])].glance(candidates[place])
        return sorted(((more * promise, start) for promise, start in promised), key=lambda g: -g[0])

    glances = in_processes(glance, range(len(candidates)))
    order = sorted(range(len(candidates)), key=lambda k: -glances[k][0][0])
    screen = Screen(tangent, ranges)

    def look(place: int) -> Look:
        effect, glanced = candidates[order[place]], glances[order[place]]
        found = [screen.at(effect, glanced[0][1])] if place >= most else _climbed(screen, effect, glanced)
        far = _far_look(screen, effect)
        return max([*found, far] if far else found, key=lambda one: one.gain)

    found = in_processes(look, range(len(order)), [*candidates, *tangent.fit.model.common])
    return sorted(found, key=lambda one: -one.gain)


def usual_looks(tangent: Tangent, candidates: Sequence[Effect]) -> list[Look]:
    """All candidates at their usual size, where nothing is left for them to take."""
    screen = Screen(tangent)
    common = [*candidates, *tangent.fit.model.common]
    return in_processes(lambda effect: screen.at(effect, effect.typical), candidates, common)


def _climbed(screen: Screen, effect: Effect, glanced: Sequence[tuple[float, Vector]]) -> list[Look]:
    """Looks from the most promising starts, until one keeps what a glance promised."""
    found: list[Look] = []
    for promise, start in glanced[:STARTS]:
        found.append(screen.climb(effect, start))
        if found[-1].gain >= KEPT * promise:
            break
    return found


def _far_look(screen: Screen, effect: Effect) -> Look | None:
    """What a few joint steps from the effect's far points win; None where it has none, or they win nothing.

    A damper behind a dashpot yields at a speed in proportion to its force. A base without it has the mean of
    its knees in g; from there each small step towards a dashpot makes matters worse, until g is as sharp as
    behind one. No tangent shows that. Nor that of a base which has a friction's knee in its g, or which has
    bent its h to and fro for a warmth that the case does not show.
    """
    if effect.far is None or screen.tangent.frozen:  # nothing may settle beside it
        return None
    fit = screen.tangent.fit
    warm = effect.stage is Stage.TEMPERATURE
    if warm and not winds(fit):
        return None
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
    points = [alone.pack({effect.name: effect.within(point)}) for point in effect.far(screen.ranges)]
    base = without_temperature(fit) if warm else fit.theta
    starts = [np.concatenate([base, point]) for point in points]
    if warm or effect.stage in _KNOWN_FORCE:  # the base settles beside it first
        starts = [heat(own, start, free=beside).theta for start in starts]
    least = replace(fit, model=few).total
    won = [one for one in (heat(own, start, free=joint) for start in starts) if one.total < least]
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
        if fit.total - found[-1].total >= KEPT * (least - one.total) / least * fit.total:
            break
    return found


def winds(fit: JointFit) -> bool:
    """Whether a base's h goes to and fro over the case's temperatures, as no fluid's does."""
    warmest = max(float(r.temperature_c.max()) for r in fit.model.records)
    seen = fit.model.layout.temperature_c <= warmest
    if np.count_nonzero(seen) < FEWEST_TO_WIND:
        return False
    tables = (h[seen] for h in (fit.tables.h_on, fit.tables.h_off))
    return any(float(np.abs(np.diff(h)).sum() - np.ptp(h)) > WINDING for h in tables)
