"""A second opinion on the base model: fitted so that a minority of bad samples does not draw it off.

An effect that acts for a short part of the time with great force (a stop, a limit) leaves a least-squares
base in a place from which no fit with the effect finds back. Weights that fall with the error leave that part
out; so does a cut below a force that no compression exceeds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.trusting import as_plain, fitted_trusting
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.noise import SCALE

Array = NDArray[np.float64]

HEAVY_TAIL = 1.5  # RMS over the robust scale from which a second opinion is worth its time (Gauss: 1)
ROUNDS = 8
STILL = 1e-3  # of the cost, that it changes by in a round which is the last
FEW, MANY = 6, 20  # iterations: of one round, and where all is known from the start
WIDTH = 2.5  # robust scales at which a sample counts half
ALIKE, ALIKE_SHARE = 3, 0.06  # records that stop at the same force, and how alike
UNLIKE_SHARE = 0.1  # by which their rebound forces differ at least, if it is compression that is limited
MARGIN = 0.2  # of a limit, left out with it


def second_opinions(fit: JointFit) -> list[JointFit]:
    """The same base fitted in other ways where the errors give reason to; judged by the plain model."""
    found = []
    model = fit.model
    residual = np.concatenate(model.residuals(fit.theta))
    if float(np.sqrt(np.mean(residual**2))) > HEAVY_TAIL * _scale(residual):
        found.append(_falling_weights(fit))
    limit = _common_limit(model)
    if limit is not None:
        found.append(_below(fit, limit))
    return found


def _falling_weights(fit: JointFit) -> JointFit:
    """Cauchy weights, their scale falling with the median error."""
    model, theta, last = fit.model, fit.theta, np.inf
    for _ in range(ROUNDS):
        errors = [model.weighed(r, e) for e, r in zip(model.errors(theta), model.records, strict=True)]
        width = WIDTH * _scale(np.concatenate(errors))
        trust = [1.0 / np.sqrt(1.0 + (e / width) ** 2) for e in errors]
        other = fitted_trusting(fit, theta, trust, FEW)
        theta = other.theta
        if abs(other.total - last) < STILL * last:
            break
        last = other.total
    return as_plain(fit, theta)


def _common_limit(model: JointModel) -> float | None:
    """The compression force in N at which several records stop alike, while their rebounds differ."""
    lows = np.array([-float(np.quantile(r.force_n, 0.01)) for r in model.records])
    highs = np.array([float(np.quantile(r.force_n, 0.99)) for r in model.records])
    limit = float(lows.max())
    stopped = lows > (1.0 - ALIKE_SHARE) * limit
    if limit <= 0.0 or np.count_nonzero(stopped) < ALIKE:
        return None
    rebound = highs[stopped]
    return limit if np.ptp(rebound) > UNLIKE_SHARE * np.abs(rebound).max() else None


def _below(fit: JointFit, limit: float) -> JointFit:
    """Without the samples near the limit."""
    model = fit.model
    trust = [
        (model.weighed(r, r.force_n) > -(1.0 - MARGIN) * limit).astype(np.float64) for r in model.records
    ]
    theta = fit.theta
    for _ in range(2):
        theta = fitted_trusting(fit, theta, trust, MANY).theta
    return as_plain(fit, theta)


def _scale(residual: Array) -> float:
    return max(SCALE * float(np.median(np.abs(residual))), 1e-12)
