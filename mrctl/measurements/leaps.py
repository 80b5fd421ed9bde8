"""Single samples that no damper makes, and what drives a model in place of an acceleration that has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrctl.measurements.averaging import behind
from mrctl.measurements.derivative import differentiate
from mrctl.measurements.run import FloatArray, Run

TALL = 30.0  # robust deviations from the mean of the two neighbours
OF_RANGE = 0.2  # of the range in which 98 % of the samples lie, that a leap is tall at least
ALIKE = 0.3  # of its height, that the neighbours may differ: else it is a step
SCALE = 1.4826  # of a median of sizes, to the deviation of normal noise
FEWEST_ROWS = 20


def leaps(values: FloatArray) -> tuple[np.ndarray, float]:
    """Which samples (n,) lie far from both their neighbours, which are alike; the height of the tallest."""
    if len(values) < FEWEST_ROWS:
        return np.empty(0, dtype=int), 0.0
    before, here, after = values[:-2], values[1:-1], values[2:]
    height = np.abs(here - 0.5 * (before + after))
    usual = SCALE * float(np.median(height))
    low, high = np.quantile(values, [0.01, 0.99])
    least = max(TALL * usual, OF_RANGE * float(high - low), 1e-12)
    at = np.flatnonzero((height > least) & (np.abs(after - before) < ALIKE * height))
    return at + 1, float(height[at].max(initial=0.0))


def has_witness(run: Run) -> bool:
    """Whether the acceleration was measured, and the velocity was not made of it."""
    derived = {*run.derived}
    return "acceleration_m_s2" not in derived and not {"velocity_m_s", "displacement_m"} <= derived


def as_it_moved(run: Run) -> Run:
    """The run with the motion that drives a model: behind a moving mean, by no accelerometer that leaps.

    A mass times a single sample of which the velocity knows nothing is a force that no damper made: such a
    run's acceleration is the slope of its velocity.
    """
    there = behind(run)
    if not has_witness(run) or not leaps(run.acceleration_m_s2)[0].size:
        return there
    return replace(there, acceleration_m_s2=differentiate(there.velocity_m_s, run.dt_s))
