"""A look at every candidate beside one model, best first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.screen import Look, Screen, reach_of
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.far_looks import FAINT, KEPT, Promise, far_look, far_points, promises
from mrctl.identify.processes import in_processes
from mrctl.model.effects.base import Effect, Vector

Array = NDArray[np.float64]

CLIMBED = 7
STARTS = 3  # from which an effect is looked at closely, until one keeps what the glance promised there


def looks(tangent: Tangent, candidates: Sequence[Effect], most: int = CLIMBED) -> list[Look]:
    """All candidates, best first; only the `most` best of a first glance are looked at closely.

    Of one that is looked at from afar, too, the better look counts.
    """
    ranges = reach_of(tangent.fit.model)
    whole = float(tangent.residual @ tangent.residual)

    parts = [tangent.glance(effect) for effect in candidates]
    few = {id(part): Screen(part, ranges) for part in parts}

    def glance(place: int) -> list[tuple[float, Vector]]:
        rest = parts[place].residual
        more = whole / max(float(rest @ rest), 1e-30)
        promised = few[id(parts[place])].glance(candidates[place])
        return sorted(((more * promise, start) for promise, start in promised), key=lambda g: -g[0])

    def to_do(place: int) -> int:
        effect = candidates[place]
        return len(effect.starting_points(ranges)) * len(effect.parameters)

    # What takes longest first, so that nothing waits for it.
    places = sorted(range(len(candidates)), key=to_do, reverse=True)
    glances = dict(zip(places, in_processes(glance, places), strict=True))
    order = sorted(range(len(candidates)), key=lambda k: -glances[k][0][0])
    screen = Screen(tangent, ranges)

    def near(place: int) -> Look:
        effect, glanced = candidates[order[place]], glances[order[place]]
        found = [screen.at(effect, glanced[0][1])] if place >= most else _climbed(screen, effect, glanced)
        return max(found, key=_gain)

    common = [*candidates, *tangent.fit.model.common]
    to_ask: list[Callable[[], Look | list[Promise]]] = [
        *(partial(promises, screen, *far) for far in far_points(screen, candidates)),
        *(partial(near, place) for place in sorted(range(len(order)), key=lambda n: -to_do(order[n]))),
    ]
    asked = in_processes(_asked, to_ask, common)
    found = [one for one in asked if not isinstance(one, list)]
    least = FAINT * max((one.gain for one in found), default=0.0)
    worth = [[p for p in one if p.gain > least] for one in asked if isinstance(one, list)]
    further = in_processes(partial(far_look, screen), [some for some in worth if some], common)
    found += [one for one in further if one is not None]
    best = {one.effect.name: one for one in sorted(found, key=_gain)}
    return sorted(best.values(), key=_gain, reverse=True)


def _asked(what: Callable[[], Look | list[Promise]]) -> Look | list[Promise]:
    return what()


def _gain(look: Look) -> float:
    return look.gain


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
