"""Single samples that no damper makes: a cable that is struck, a converter that drops a bit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrctl.measurements.quality.finding import Finding, warning
from mrctl.measurements.quality.sensors import measured_channels
from mrctl.measurements.run import FloatArray, Run

TALL = 30.0  # robust deviations from the mean of the two neighbours
OF_RANGE = 0.2  # of the range in which 98 % of the samples lie, that a spike is tall at least
ALIKE = 0.3  # of its height, that the neighbours may differ: else it is a step
SCALE = 1.4826  # of a median of sizes, to the deviation of normal noise
FEWEST_ROWS = 20


def check_spikes(run: Run) -> Iterator[Finding]:
    """Samples far from both their neighbours, which are alike, in force and the measured motion."""
    mend = "look at the sensor's cable; cut the samples out, or the run"
    channels = [(name, values, mend) for _, name, values in measured_channels(run)]
    if "acceleration_m_s2" not in run.derived:
        mend = "look at the sensor's cable; leave the column out, and it is made of the velocity"
        channels.append(("acceleration_m_s2", run.acceleration_m_s2, mend))
    for name, values, mend in channels:
        at, height = _spikes(values)
        if at.size:
            times = "once" if at.size == 1 else f"{at.size} times"
            yield warning(run, int(at[0]), f"{name} leaps by {height:.3g} for a single sample, {times}", mend)


def _spikes(values: FloatArray) -> tuple[np.ndarray, float]:
    """Where they are, and the height of the tallest."""
    if len(values) < FEWEST_ROWS:
        return np.empty(0, dtype=int), 0.0
    before, here, after = values[:-2], values[1:-1], values[2:]
    height = np.abs(here - 0.5 * (before + after))
    usual = SCALE * float(np.median(height))
    low, high = np.quantile(values, [0.01, 0.99])
    least = max(TALL * usual, OF_RANGE * float(high - low), 1e-12)
    at = np.flatnonzero((height > least) & (np.abs(after - before) < ALIKE * height))
    return at + 1, float(height[at].max(initial=0.0))
