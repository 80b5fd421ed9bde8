"""A fluid's own warmth in runs made one after the other, which no fit sees that begins them all alike."""

from __future__ import annotations

from collections.abc import Sequence

from mrctl.discover import taken_anew
from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.grow import grown_by
from mrctl.discover.fits.proof import prove
from mrctl.discover.search.levels import Level, Trial, trial_of
from mrctl.discover.verdict.worth import accepted
from mrctl.model.effects.base import Effect, Stage

PROMISING = 0.1  # of what is left, that a look at a warmth must take


def begun_warm(
    evidence: Evidence, level: Level, candidates: Sequence[Effect]
) -> tuple[Evidence, Trial] | None:
    """The runs as warm at their starts as an effect on the temperature finds, and its trial with them.

    None where none is real, or looks like much. level: the round in which nothing was found.
    """
    warm = {e.name for e in candidates if e.stage is Stage.TEMPERATURE}
    for look in level.looks:
        if look.effect.name not in warm or look.gain < PROMISING * level.whole:
            continue
        alike = prove(grown_by(level.before.fit, look.effect), evidence.folds)
        anew, there = taken_anew.begun_warm(evidence, alike, level.before)
        trial = trial_of(level.before, look, there)
        if anew is not evidence and accepted(trial, level.before, len(candidates)):
            return anew, trial
    return None
