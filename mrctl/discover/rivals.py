"""Which effects this campaign cannot tell from one that was found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.screen import Look
from mrctl.discover.search import Level, Trial

Array = NDArray[np.float64]

CLOSE_SCORE = 10.0  # BIC: below this the data do not decide ("very strong" begins here, Kass & Raftery 1995)
SAME_DIRECTION = 0.98  # share of an effect's force that a rival's slopes make up for
SAME_REMOVED = 0.97  # of what the found effect takes off, where neither reaches the noise


@dataclass(frozen=True, slots=True)
class Rival:
    """An effect that explains about as much, and why it cannot be ruled out."""

    name: str
    why: str


def rivals_of(chosen: Trial, level: Level, *, cleared: bool) -> list[Rival]:
    """Rivals of a trial at its level; `cleared`: with it, nothing but noise is left."""
    found: dict[str, Rival] = {}
    removed = chosen.gain
    for other in level.trials:
        if other.effect.name == chosen.effect.name:
            continue
        name = other.effect.name
        if chosen.score - other.score < CLOSE_SCORE:
            found[name] = Rival(name, "it fits this campaign as well")
        elif not cleared and _taken(other) >= SAME_REMOVED * _taken(chosen) and removed > 0.0:
            found[name] = Rival(name, "it removes as much of the error, and neither reaches the noise")
    own = next(one for one in level.looks if one.effect.name == chosen.effect.name)
    for look in level.looks:
        if look.effect.name in {chosen.effect.name, *found}:
            continue
        if same_direction(own, look) >= SAME_DIRECTION:
            found[look.effect.name] = Rival(
                look.effect.name, "in this campaign its force has the same course, whatever its size and sign"
            )
    return list(found.values())


def _taken(trial: Trial) -> float:
    return -trial.proof.mean_square


def same_direction(one: Look, other: Look) -> float:
    """The share of one look's force, beyond the model, that the other's slopes make up for, signs free."""
    size = float(one.force @ one.force)
    if size <= 0.0 or other.slopes.shape[0] == 0:
        return 0.0
    rows = np.concatenate([other.slopes, other.force[None]])
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[length[:, 0] > 1e-9 * np.sqrt(size)] / length[length[:, 0] > 1e-9 * np.sqrt(size)]
    if not rows.size:
        return 0.0
    answer, *_ = np.linalg.lstsq(rows.T, one.force, rcond=1e-6)
    rest = one.force - answer @ rows
    return 1.0 - float(rest @ rest) / size
