"""The zero of the load cell, which is another in each run: no physics, and not to be taken for any.

A gas spring whose force is fitted over runs of different mean stroke takes up such offsets, as a rise of
temperature does where each run has its own. What is alike in all runs stays: that is an effect.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from mrctl.identify.noise import correlation_inflation

Array = NDArray[np.float64]

FEWEST_RUNS = 3
CHANCE = 1e-4  # that runs of one zero differ so
LARGEST = 0.01  # of the largest force: no load cell wanders further, and the model is wrong
FULL_SCALE = 0.995  # quantile of the absolute force that counts as the largest
COMMON = 3.0  # standard errors of the mean zero, above which it is an offset of all runs


def run_zeros(errors: Sequence[Array], forces: Sequence[Array], before_n: Array) -> Array:
    """Each run's zero in N (runs) by what a model leaves of its force (n each, N); zeros where all are one.

    forces (n each, N): as measured, for the full scale. before_n (runs): what was taken off the errors'
    measured force already.
    """
    none = np.zeros(len(errors))
    if len(errors) < FEWEST_RUNS:
        return none
    means = np.array([float(e.mean()) for e in errors]) + before_n
    doubts = np.array([float(e.std()) * np.sqrt(correlation_inflation(e) / e.size) for e in errors])
    middle = float(means.mean())
    apart = means - middle
    if chi2.sf(float(np.sum((apart / np.maximum(doubts, 1e-12)) ** 2)), len(errors) - 1) > CHANCE:
        return none
    most = LARGEST * max(float(np.quantile(np.abs(f), FULL_SCALE)) for f in forces)
    if float(np.max(np.abs(apart))) > most:
        return none
    # As many zeros as there are runs have a mean of their own.
    own = abs(middle) < COMMON * float(apart.std(ddof=1)) / np.sqrt(len(errors))
    return means if own else apart
