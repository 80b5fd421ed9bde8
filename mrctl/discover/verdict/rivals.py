"""Which effects this campaign cannot tell from one that was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.screen import Look, Screen
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.levels import Level, Trial
from mrctl.discover.verdict.worth import is_nothing, is_stretched
from mrctl.identify.effects_fit import bare_damper
from mrctl.model.effects.base import Effect, Vector
from mrctl.simulate import stages

Array = NDArray[np.float64]

CLOSE_SCORE = 10.0  # BIC: below this the data do not decide ("very strong" begins here, Kass & Raftery 1995)
SAME_DIRECTION = 0.93  # share of an effect's force that a rival's slopes make up for
GOOD_PART = 0.2  # of a force's square sum that one of its parameters must make, to be looked at by itself
BLOCKED = 0.1  # of the found effect's gain: what takes less, was held back
AS_GOOD, AS_GOOD_SHARE = 1.01, 0.98  # of the mean square left, of that taken: a smaller effect does it too
CONTAINED = 0.99  # as SAME_DIRECTION, where one effect is a special case of the other
STEADY_LEVEL = 0.15  # spread of f h over its median: in less, only an exact form tells what hangs on it
FORM_SHARE, FORM_LEFT = 0.985, 1.03  # of what is taken and left: nearer, and only an exact form would tell
BENT_LEFT = 1.05  # as FORM_LEFT, beside an effect that comes as near only at the ends of its form


@dataclass(frozen=True, slots=True)
class Rival:
    """An effect that explains about as much, and why it cannot be ruled out."""

    name: str
    why: str
    other_current: bool = False  # no run at the campaign's own tells it apart


def simplest(best: Trial, level: Level, allowed: Sequence[Trial]) -> Trial:
    """The trial with the fewest parameters among those that do as well as the best one and are allowed.

    An effect that has another as its special case always fits a little better; its freedom must earn more.
    So must that of one that fits better only where it is bent as far as it goes.
    """
    before = level.before.mean_square
    equals = [
        t
        for t in allowed
        if t.proof.mean_square < AS_GOOD * best.proof.mean_square
        and before - t.proof.mean_square > AS_GOOD_SHARE * (before - best.proof.mean_square)
        and (t is best or contains(best, t, level))
    ]
    equals += [t for t in allowed if _is_bent_to(best, t, level)]
    return min(equals, key=lambda t: (t.parameters, -t.score), default=best)


def contains(larger: Trial, smaller: Trial, level: Level) -> bool:
    """Whether the smaller effect's force is a special case of the larger one's."""
    looks = {one.effect.name: one for one in level.looks}
    own, other = looks[smaller.effect.name], looks[larger.effect.name]
    return larger.parameters > smaller.parameters and same_direction(own, other, parts=False) >= CONTAINED


def rivals_of(chosen: Trial, level: Level) -> list[Rival]:
    """Rivals of a trial at its level: what this campaign does not tell from it."""
    found: dict[str, Rival] = {}
    larger = {
        t.effect.name
        for t in level.trials
        if contains(t, chosen, level) and AS_GOOD * t.proof.mean_square > chosen.proof.mean_square
    }
    for other in level.trials:
        name = other.effect.name
        if name == chosen.effect.name or name in larger or _is_bent_to(other, chosen, level):
            continue
        if chosen.score - other.score < CLOSE_SCORE:
            found[name] = Rival(name, "it fits this campaign as well")
        elif _as_near(chosen, other, level):
            found[name] = Rival(name, "it leaves hardly more: only exact forms would tell them apart")
    why = "in this campaign its force has the same course, whatever its size and sign"
    for name in _still_alike(chosen, _alike(chosen, level, {*found, *larger})):
        found[name] = Rival(name, why)
    for name in sorted(_alike_at_one_level(chosen, level) - set(found)):
        why = "at one f h it is the same: only another current tells them apart"
        found[name] = Rival(name, why, other_current=True)
    return list(found.values())


def _alike(chosen: Trial, level: Level, known: set[str]) -> list[Look]:
    """Looks, but for known ones, at a force of the same course that bounds kept from fitting as well."""
    own = next(one for one in level.looks if one.effect.name == chosen.effect.name)
    blocked = []
    for look in level.looks:
        name = look.effect.name
        if name in {chosen.effect.name, *known} or not (look.plausible and _one_sided(look.effect)):
            continue
        fits = next((t.gain_at_most for t in level.trials if t.effect.name == name), 0.0)
        if fits < BLOCKED * chosen.gain:  # by its bounds: as itself it was not seen to fit worse
            blocked.append(look)
    own, *blocked = _plain([own, *blocked], level)
    return [one for one in blocked if same_direction(own, one) >= SAME_DIRECTION]


def _plain(seen: list[Look], level: Level) -> list[Look]:
    """The looks, those that came to nothing without what their effects may do besides.

    How late a mass's force comes says nothing where bounds left no mass, but its slopes hang on it. The model
    may have found a better valley since, so that all are taken anew beside it.
    """
    values = [_plainest(one) for one in seen]
    if values == [one.values for one in seen]:
        return seen
    screen = Screen(Tangent.of(level.before.fit))
    return [screen.at(one.effect, there) for one, there in zip(seen, values, strict=True)]


def _plainest(look: Look) -> Vector:
    """A look's parameters, what is optional left out where they make no force."""
    if not is_nothing(look.effect, look.values):
        return look.values
    both = zip(look.effect.parameters, look.values, strict=True)
    return tuple(p.neutral if p.optional else x for p, x in both)


def _alike_at_one_level(chosen: Trial, level: Level) -> set[str]:
    """The candidates that only another f h would tell from an effect; none where f h varies."""
    names = chosen.effect.alike_at_one_level & {one.effect.name for one in level.looks}
    if not names:
        return set()
    model = chosen.fit.model
    tables = bare_damper(model.layout, chosen.fit.tables, model.records[0].rate_hz).static
    levels = [stages.level(r.current_a, r.temperature_c, tables) for r in model.records]
    low, middle, high = np.quantile(np.concatenate(levels), (0.02, 0.5, 0.98))
    return set(names) if high - low < STEADY_LEVEL * middle else set()


def _still_alike(chosen: Trial, alike: Sequence[Look]) -> list[str]:
    """Which of these have its force's course beside the model that was found too.

    A base that went to make up for a large effect moves along other slopes than one that has the effect
    beside it: what tells two motions apart looks absorbed there. One that makes the same force from nothing
    on, and has more to say besides, was not kept from it by bounds: it has the effect as a special case.
    """
    if not alike:
        return []
    screen = Screen(Tangent.of(chosen.fit.less({chosen.effect.name})))
    own = screen.at(chosen.effect, chosen.fit.effect_values[chosen.effect.name])
    others = [screen.at(look.effect, look.values) for look in alike]
    return [
        other.effect.name
        for other in others
        if same_direction(own, other) >= SAME_DIRECTION and not _reaches(screen, own, other)
    ]


def _reaches(screen: Screen, own: Look, other: Look) -> bool:
    """Whether a larger effect, begun at nothing, comes to take as much as the one found does."""
    if np.count_nonzero(other.free) <= np.count_nonzero(own.free):
        return False
    return screen.climb(other.effect, other.effect.neutral).gain >= AS_GOOD_SHARE * own.gain


def _one_sided(effect: Effect) -> bool:
    """Whether bounds may keep it from a force that it has the course of; else it would have fitted."""
    return any(p.neutral in (p.low, p.high) for p in effect.parameters if not p.optional)


def _as_near(chosen: Trial, other: Trial, level: Level, most_left: float = FORM_LEFT) -> bool:
    """Whether two effects' forms would have to be exact for what one leaves more to mean anything."""
    before, left, more = (p.mean_square for p in (level.before, chosen.proof, other.proof))
    return before - more > FORM_SHARE * (before - left) and more < most_left * left


def _is_bent_to(larger: Trial, smaller: Trial, level: Level) -> bool:
    """Whether an effect of more parameters does little better, and only at the ends of its form."""
    ends = [is_stretched(t.effect, t.fit.effect_values[t.effect.name]) for t in (larger, smaller)]
    return (
        ends == [True, False]
        and larger.parameters > smaller.parameters
        and _as_near(larger, smaller, level, BENT_LEFT)
    )


def same_direction(one: Look, other: Look, *, parts: bool = True) -> float:
    """The share of one look's force, beyond the model, that the other's slopes make up for, signs free.

    parts: or of the part that one of its proportional parameters makes, where that is more.
    """
    whole = float(one.force @ one.force)
    if whole <= 0.0 or other.slopes.shape[0] == 0:
        return 0.0
    # The force as a whole, and what each proportional parameter that defines the effect makes of it.
    pieces = [one.force]
    moving = [
        (p, x) for p, x, moves in zip(one.effect.parameters, one.values, one.free, strict=True) if moves
    ]
    for slope, (p, value) in zip(one.slopes, moving, strict=True):
        made = slope * value / p.step_scale
        if parts and p.linear and p.typical and float(made @ made) > GOOD_PART * whole:
            pieces.append(made)
    return max(_made_up(piece, other) for piece in pieces)


def _made_up(force: Array, other: Look) -> float:
    size = float(force @ force)
    # Only where the force is proportional: a shape that can be bent at will lies along anything.
    free = [p for p, moves in zip(other.effect.parameters, other.free, strict=True) if moves]
    straight = np.array([p.linear for p in free], dtype=bool)
    rows = np.concatenate([other.slopes[straight], other.force[None]])
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[length[:, 0] > 1e-9 * np.sqrt(size)] / length[length[:, 0] > 1e-9 * np.sqrt(size)]
    if not rows.size:
        return 0.0
    answer, *_ = np.linalg.lstsq(rows.T, force, rcond=1e-6)
    rest = force - answer @ rows
    return 1.0 - float(rest @ rest) / size
