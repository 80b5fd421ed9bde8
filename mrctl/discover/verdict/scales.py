"""Runs whose forces differ in zero or scale: what is taken off each, and whether that is all there is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.proof import Proof, log_gain
from mrctl.discover.search.levels import Trial
from mrctl.discover.verdict.judged import NAMING, Judged, judged_by
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.run_scatter import FEWEST_RUNS
from mrctl.model.effects.base import Effect

MOST_TIMES = 4  # that scales are taken: the first time the tables have made up for some
ZERO_AND_SCALE = 2  # numbers of each run
FEWEST_ALONE = 3  # runs whose scales may be all that is missing, once effects are weighed against them


def evened(evidence: Evidence, base: Proof, known: Sequence[Effect]) -> tuple[Evidence, Proof]:
    """The evidence without its runs' own scales, and its base, while with them nothing but noise is left."""
    return _to_their_end(Evidence.evened, evidence, base, known)


def scales_instead(
    evidence: Evidence, base: Proof, known: Sequence[Effect], judged: Judged
) -> tuple[Evidence, Proof, Judged] | None:
    """The evidence, the base and the verdict, where runs that differ in scale are all that is missing.

    None where they are not, or effects are named that say as much with fewer parameters. Few runs may say so
    too: each at its own conditions, their scales agree with some effect by chance. The scales are taken to
    their end, since tables and they make up for each other.
    """
    named = judged.verdict in NAMING
    if judged.verdict != "unexplained" and not (named and len(evidence.full) < FEWEST_RUNS):
        return None
    taken = partial(Evidence.scaled, fewest=FEWEST_ALONE)
    there, scaled = _to_their_end(taken, evidence, base, known)
    if there is evidence:
        return None
    stated = sum(trial.parameters for trial, _ in judged.stands)
    if named and not says_more(judged.final, stated, scaled, len(evidence.full) - 1):
        return None
    alone = judged_by(there, scaled, scaled, [])
    return (there, scaled, alone) if alone.verdict == "none" else None


def is_the_rigs(trial: Trial, evened: Proof) -> bool:
    """Whether zeros and scales of the runs say more than an effect that would come to a model next (BIC)."""
    return says_more(trial.proof, trial.parameters, evened, ZERO_AND_SCALE * evened.inside.size)


def says_more(effects: Proof, parameters: int, runs: Proof, numbers: int) -> bool:
    """Whether a model with so many numbers of its runs is worth more than one with effects' parameters."""
    return log_gain(effects, runs) > (numbers - parameters) * float(np.log(runs.independent))


def _to_their_end(
    taken: Callable[[Evidence, JointFit], Evidence], evidence: Evidence, base: Proof, known: Sequence[Effect]
) -> tuple[Evidence, Proof]:
    """The evidence with the runs' scales taken off by the base, that fitted anew, until none is left."""
    for _ in range(MOST_TIMES):
        even = taken(evidence, base.fit)
        if even is evidence:
            break
        evidence, base = even, even.base(known, base.fit.effect_values, base.fit)
    return evidence, base
