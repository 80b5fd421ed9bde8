"""Poles of H that are slower than any motion measured, and whether a campaign needs them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import hysteresis
from mrctl.identify.bounds import SLOWEST_POLE
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.noise import correlation_inflation
from mrctl.identify.plain_lags import with_plain_lag
from mrctl.identify.records import Record

Array = NDArray[np.float64]

SLOWER = 0.7  # than the slowest motion: a pole there would stand below all that was measured
STILL_POWER = 0.01  # of a record's strongest: less is no motion
GRANTED = 1.5  # times the mean square without such poles, before they are taken for real, ...
GRANTED_NOISE = 1.05  # ... or this, where with them nothing but white noise is left
WHITE = 1.5  # correlation inflation of residuals that may pass for it


def within_reach(fit: JointFit, rounds: int, iterations: int) -> JointFit:
    """The fit, or one without poles slower than any motion measured, where that is nearly as good.

    What H does below the slowest motion no data show, but it is what the static force hangs on: H is 1 for a
    steady force. A filter that makes up for something that the model lacks (a loop that is rounder than a lag
    makes it, say) puts a pole there which wins a few percent where it was measured, and has the static force
    wrong by a multiple. A true pole there is kept: without it the fit leaves far more than the noise.
    """
    model = fit.model
    slowest = max(
        SLOWEST_POLE, SLOWER * slowest_motion_hz(model.records) * 2.0 * np.pi / hysteresis.UNIT_RAD_S
    )
    bounded = replace(model, slowest_pole=slowest)
    lower, _ = bounded.bounds()
    if np.all(fit.theta >= lower):
        bounded.weigh_as(model)
        return JointFit(bounded, fit.solution, fit.penalties)
    fits = []
    for theta in (np.maximum(fit.theta, lower), with_plain_lag(model, fit.theta)):
        bounded.reweigh(theta)
        fits.append(bounded.fit(theta, penalties=fit.penalties, rounds=rounds, iterations=iterations))
    best = min(fits, key=misfit)
    left = model.residuals(fit.theta)
    white = float(np.median([correlation_inflation(r) for r in left])) < WHITE
    granted = sum(r.size for r in left) * np.log(GRANTED_NOISE if white else GRANTED)
    return best if misfit(best) - misfit(fit) < granted else fit


def slowest_motion_hz(records: Sequence[Record]) -> float:
    """The lowest frequency in Hz at which any record moves."""
    return min(map(_slowest_hz, records))


def _slowest_hz(record: Record) -> float:
    v = record.velocity_m_s
    power = np.abs(np.fft.rfft((v - v.mean()) * np.hanning(v.size))) ** 2
    hz = np.fft.rfftfreq(v.size, 1.0 / record.rate_hz)
    return float(hz[np.flatnonzero(power >= STILL_POWER * power.max())[0]])


def misfit(fit: JointFit) -> float:
    """Log-likelihood loss, each record with a noise of its own.

    A record counts whole, whatever is left out of its start: else the fit that leaves out most would do best.
    """
    model = fit.model
    left = zip(model.records, model.residuals(fit.theta), strict=True)
    return float(sum(len(x) // model.factor(x) * np.log(np.mean(r * r)) for x, r in left))
