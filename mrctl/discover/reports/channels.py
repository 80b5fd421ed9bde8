"""What the channels themselves did, and was taken out before anything was looked for: words and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.diagnose import Diagnosis

Array = NDArray[np.float64]

LOST = 0.03  # of a motion, that tells how far a velocity was smoothed


def channel_figures(d: Diagnosis) -> dict[str, Any]:
    """The same for a machine, by run in N, parts of the force, m and s; runs without any left out."""
    smoothing = d.evidence.smoothing
    return {
        "zeros_n": _by_run(d, d.evidence.cell.zeros_n.tolist()),
        "gains": _by_run(d, d.evidence.cell.gains.tolist()),
        "warmer_at_start_k": _by_run(d, [r.warmer_k for r in d.evidence.measured]),
        "strokes_moved_m": _by_run(d, d.evidence.centres_m),
        "rests_s": _by_run(d, d.evidence.rests_s),
        "current_late_s": d.evidence.current_late_s,
        "velocity_smoothed": None if smoothing is None else asdict(smoothing),
    }


def channel_words(d: Diagnosis) -> str:
    """What the channels themselves did, and was taken out."""
    words = ""
    if d.evidence.cell.zeros_n.any():
        words += f" The load cell's zero differs from run to run, {_spread(d, d.evidence.cell.zeros_n, 'N')}."
    if d.evidence.cell.gains.any():
        percent = 100.0 * d.evidence.cell.gains
        words += f" The force's scale differs from run to run, {_spread(d, percent, '%')}."
    pasts = [d.evidence.campaign.runs[r.run].name for r in d.evidence.measured if r.before_a]
    if pasts:
        words += (
            f" The field remembers a larger current from before {len(pasts)} of the runs ({pasts[0]} first)."
        )
    warm = [abs(r.warmer_k) for r in d.evidence.measured if r.warmer_k]
    if warm:
        words += (
            f" The fluid begins its runs up to {max(warm):.2g} K warmer or colder than in the mean: taken so."
        )
    far = [abs(x) for x in d.evidence.centres_m if x]
    if far:
        span = f"{1e3 * max(far):.2g} mm"
        words += f" The stroke has another zero in {len(far)} runs, by up to {span}: taken so."
    resting = [x for x in d.evidence.rests_s if x]
    if resting:
        span = f"{max(resting):.2g} s"
        words += (
            f" {len(resting)} of the runs rest, for up to {span}: the velocity is taken for noise there,"
            " and what came before the first motion left out."
        )
    if d.evidence.current_late_s:
        words += f" The current was written {1e3 * d.evidence.current_late_s:.2g} ms late: taken as earlier."
    if d.evidence.smoothing is not None:
        lost_hz = d.evidence.smoothing.frequency_hz(LOST)
        words += f" The velocity was smoothed, {100.0 * LOST:.0f} % of it gone at {lost_hz:.3g} Hz: put back."
    return words


def _spread(d: Diagnosis, values: Array, unit: str) -> str:
    """How far the runs differ, and which one most: that may be one that says little of itself."""
    most = int(np.argmax(np.abs(values)))
    name = d.evidence.campaign.runs[d.evidence.measured[most].run].name
    rms = float(np.sqrt(np.mean(values**2)))
    return f"by {rms:.2g} {unit} RMS, most in {name} ({values[most]:+.2g} {unit}): taken out"


def _by_run(d: Diagnosis, values: Sequence[float]) -> dict[str, float]:
    """Values of the records by the names of their runs, but for those that are 0."""
    named = zip(d.evidence.measured, values, strict=False)  # of strokes there may be none at all
    return {d.evidence.campaign.runs[r.run].name: x for r, x in named if x}
