"""A later effect in the place of an earlier one that had stood in for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrctl.discover.fits.grow import Folds
from mrctl.discover.fits.proof import Proof, log_gain
from mrctl.discover.fits.settle import without
from mrctl.discover.search.levels import Trial
from mrctl.discover.verdict.worth import LEAST_SCORE


def exchanged(here: Proof, later: Trial, found: Sequence[Trial], folds: Folds) -> tuple[Proof, Trial] | None:
    """The model with the later effect but without an earlier one, where it says more; and the one that goes.

    A base that has made up for an effect may show another one first, and the true one only beside that: there
    it takes little, and looks like a patch on the other's form.
    """
    without_it = [(without(later.proof, one.effect.name, folds), one) for one in found]
    proof, gone = min(without_it, key=lambda pair: pair[0].mean_square)
    dearer = (later.parameters - gone.parameters) * float(np.log(proof.independent))
    return (proof, gone) if log_gain(here, proof) - dearer > LEAST_SCORE else None
