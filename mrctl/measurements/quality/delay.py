"""Force that turns too late or too early: a delay between channels, as far as it can be told."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from mrctl.measurements.quality.finding import Finding, spread, warning
from mrctl.measurements.run import FloatArray, Run

MIN_TURNS = 4
LAG_S, LAG_DEGREES = 8e-3, 10.0
"""One run cannot tell a delay from elasticity: a real damper turned 18 ms late at 1 Hz, 9 degrees at 5 Hz."""
COMMON_LAG_S = 8e-3
"""What the lag filter of a slow damper makes by itself is up to about 5 ms."""
LEAD_S, HEAVIEST_KG = 5e-3, 30.0
"""A lead is put down to a channel only where inertia cannot explain it: fluid inertia is up to 20 kg."""


def check_delay(run: Run) -> Iterator[Finding]:
    """Force that turns later than elasticity, or earlier than inertia, would make it."""
    turns = reversals(run)
    if len(turns) < MIN_TURNS:
        return
    lag, phase, mass = (float(np.median(turns[:, column])) for column in (0, 1, 2))
    if lag > LAG_S and phase > LAG_DEGREES:
        what = f"force lags velocity by {1e3 * lag:.1f} ms ({phase:.0f} degrees): a delayed channel?"
        yield warning(
            run, None, what, "align the channels; what is left, the diagnosis can add as sensor_delay"
        )
    elif lag < -LEAD_S and mass > HEAVIEST_KG:
        what = (
            f"force leads velocity by {-1e3 * lag:.1f} ms, more than inertia explains: is velocity filtered?"
        )
        yield warning(run, None, what, "align the channels, or leave velocity out and give displacement")


def common_delay(runs: Iterable[Run]) -> list[Finding] | None:
    """A lag that all runs share, whatever their motion: a delayed channel.

    Elasticity makes force turn after a certain travel d, that is sqrt(2 d / a) after velocity, a delay after
    the same time. Over runs of different acceleration a the two come apart: lag = delay + slope(current) /
    sqrt(a).
    """
    rows = []
    for run in runs:
        turns = reversals(run)
        if len(turns) >= MIN_TURNS:
            lag, pull = float(np.median(turns[:, 0])), float(np.median(turns[:, 3]))
            rows.append((round(float(np.median(run.current_a)), 1), pull**-0.5, lag, run))
    currents = sorted({row[0] for row in rows if not np.isnan(row[0])})
    rows = [row for row in rows if row[0] in currents]
    inverse, lags = np.array([row[1] for row in rows]), np.array([row[2] for row in rows])
    if len(rows) < len(currents) + 3 or inverse.max() < 1.4 * inverse.min():
        return None
    slopes = [np.where([row[0] == current for row in rows], inverse, 0.0) for current in currents]
    basis = np.column_stack((np.ones(len(rows)), *slopes))
    weights, _, rank, _ = np.linalg.lstsq(basis, lags, rcond=None)
    residual = lags - basis @ weights
    variance = (
        float(residual @ residual) / (len(rows) - len(weights)) + min(row[3].dt_s for row in rows) ** 2 / 12
    )
    sigma = float(np.sqrt(variance * np.linalg.pinv(basis.T @ basis)[0, 0]))
    if rank == len(weights) and weights[0] > max(COMMON_LAG_S, 3 * sigma):
        what = (
            f"in all runs force comes {1e3 * weights[0]:.1f} ms late, whatever the motion: a delayed channel?"
        )
        mend = "align the channels; what is left, the diagnosis can add as sensor_delay"
        return [warning(rows[0][3], None, what, mend)]
    return []


def reversals(run: Run) -> FloatArray:
    """Each turn: lag of force in s and degrees, force / acceleration in kg, acceleration, (n, 4)."""
    if not run.has_force or spread(run.force_n) == 0:
        return np.empty((0, 4))
    velocity, force = run.velocity_m_s, run.force_n
    sure = np.flatnonzero(np.abs(velocity) > 0.1 * float(np.max(np.abs(velocity))))
    starts = [*sure[np.flatnonzero(np.diff(np.sign(velocity[sure])))], len(velocity) - 1]
    middle = 0.5 * float(np.percentile(force, 98) + np.percentile(force, 2))
    turns = []
    for start, following in pairwise(starts):
        sign = np.sign(velocity[start])
        turn = _crossing(sign * velocity[start:following]) + start
        half = max(2, following - start)
        low = max(0, int(turn) - half // 2)
        beyond = sign * (force[low : int(turn) + half // 2] - middle)
        cross = _crossing(beyond) + low
        if (
            not low < cross < low + len(beyond) - 1
        ):  # force never crosses its middle here, or had done so before
            continue
        lag = (cross - turn) * run.dt_s
        pull = max(abs(float(run.acceleration_m_s2[int(turn)])), 1e-9)
        turns.append((lag, 180.0 * (cross - turn) / half, abs(float(force[int(turn)] - middle)) / pull, pull))
    return np.array(turns).reshape(-1, 4)


def _crossing(values: FloatArray) -> float:
    """Where a noisy signal falls through zero: between the first sample below and the last above."""
    below, above = np.flatnonzero(values <= 0), np.flatnonzero(values > 0)
    if not len(below) or not len(above):
        return 0.0
    return 0.5 * float(below[0] + above[-1])
