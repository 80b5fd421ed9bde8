"""Single samples that no damper makes: a cable that is struck, a converter that drops a bit."""

from __future__ import annotations

from collections.abc import Iterator

from mrctl.measurements.leaps import has_witness, leaps
from mrctl.measurements.quality.finding import Finding, warning
from mrctl.measurements.quality.sensors import measured_channels
from mrctl.measurements.run import Run


def check_spikes(run: Run) -> Iterator[Finding]:
    """Samples far from both their neighbours, which are alike, in force and the measured motion."""
    cut = "look at the sensor's cable; cut the samples out, or the run"
    channels = [(name, values, cut) for _, name, values in measured_channels(run)]
    if "acceleration_m_s2" not in run.derived:
        slope = "look at the sensor's cable; in this run the velocity's slope is taken in its place"
        channels.append(("acceleration_m_s2", run.acceleration_m_s2, slope if has_witness(run) else cut))
    for name, values, mend in channels:
        at, height = leaps(values)
        if at.size:
            times = "once" if at.size == 1 else f"{at.size} times"
            yield warning(run, int(at[0]), f"{name} leaps by {height:.3g} for a single sample, {times}", mend)
