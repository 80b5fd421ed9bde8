"""Runs whose forces differ in scale: such a scale taken off each, or a verdict that it is all there is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from mrctl.discover.evidence import Evidence
from mrctl.discover.proof import Proof, log_gain
from mrctl.discover.verdict import NAMING, Judged, judged_by
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.run_scatter import FEWEST_RUNS
from mrctl.model.effects.base import Effect

MOST_TIMES = 4  # that scales are taken: the first time the tables have made up for some
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
    if named:
        fewer = len(evidence.full) - 1 - sum(trial.parameters for trial, _ in judged.stands)
        if log_gain(judged.final, scaled) < fewer * float(np.log(scaled.independent)):
            return None
    alone = judged_by(there, scaled, scaled, [])
    return (there, scaled, alone) if alone.verdict == "none" else None


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
