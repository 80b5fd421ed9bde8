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
from mrctl.model.effects.base import Effect, Ranges, Vector

Array = NDArray[np.float64]

CLIMBED = 7
LITTLE = 0.02  # of the best promise: an effect that promises less is not looked at closely
UNDERSTATED = 0.5  # of what a far look may gain, that some records promise at least
GLANCED = 0.25  # of what a close look may gain, that a glance promises at least
STARTS = 3  # from which an effect is looked at closely, until one keeps what the glance promised there


def looks(
    tangent: Tangent,
    candidates: Sequence[Effect],
    most: int = CLIMBED,
    *,
    afar: bool = False,
    least: float = 0.0,
    sure: str | None = None,
) -> list[Look]:
    """All candidates, best first; only the `most` best of a first glance are looked at closely.

    None of them that promises next to nothing is. Of one that is looked at from afar, too, the better look
    counts; afar: all of them are, and none closely. least: gain without which a look is of no use, but for
    one at the candidate named `sure`.
    """
    ranges = reach_of(tangent.fit.model)

    def to_do(effect: Effect) -> int:
        return len(effect.starting_points(ranges)) * len(effect.parameters)

    effects = sorted(candidates, key=to_do, reverse=True)  # so that nothing waits for what takes longest
    glances = _glances(tangent, effects, ranges)
    promised = [glanced[0][0] for glanced in glances]
    best_first = sorted(range(len(effects)), key=lambda k: -promised[k])
    little = max(LITTLE * max([0.0, *promised]), GLANCED * least)
    enough = {k for k in best_first[:most] if promised[k] >= little and not afar}
    closely = enough | {k for k, e in enumerate(effects) if e.name == sure}
    screen = Screen(tangent, ranges)

    def near(k: int) -> Look:
        if k not in closely:
            return screen.at(effects[k], glances[k][0][1])
        return max(_climbed(screen, effects[k], glances[k]), key=_gain)

    starts = {e.name: [glances[k][0][1]] for k, e in enumerate(effects)} if afar else {}
    far = far_points(screen, effects, starts)
    to_ask: list[Callable[[], Look | list[Promise]]] = [
        *(partial(promises, screen, *one) for one in far),
        *(partial(near, k) for k in range(len(effects))),
    ]
    common = [*candidates, *tangent.fit.model.common]
    asked = in_processes(_asked, to_ask, common)
    found = [one for one in asked if not isinstance(one, list)]
    faint = max(FAINT * max((one.gain for one in found), default=0.0), UNDERSTATED * least)
    worth = [[p for p in one if p.gain > faint] for one in asked if isinstance(one, list)]
    further = in_processes(partial(far_look, screen), [some for some in worth if some], common)
    found += [one for one in further if one is not None]
    best = {one.effect.name: one for one in sorted(found, key=_gain)}
    return sorted(best.values(), key=_gain, reverse=True)


def _glances(tangent: Tangent, effects: Sequence[Effect], ranges: Ranges) -> list[list[tuple[float, Vector]]]:
    """For each effect the gain that a linear step from each start promises, by a few records; most first."""
    whole = float(tangent.residual @ tangent.residual)
    parts = [tangent.glance(effect) for effect in effects]
    few = {id(part): Screen(part, ranges) for part in parts}

    def glance(k: int) -> list[tuple[float, Vector]]:
        rest = parts[k].residual
        more = whole / max(float(rest @ rest), 1e-30)
        promised = few[id(parts[k])].glance(effects[k])
        return sorted(((more * promise, start) for promise, start in promised), key=lambda g: -g[0])

    return in_processes(glance, range(len(effects)))


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
