"""Each run's own zero and scale of the force, told beside a model whose parameters move with them.

What a run leaves in the mean is not its zero: a table has made up for part of it wherever only that run went,
at a triangle's one speed say, and the other runs pay for it. So all zeros and scales are found at once, by
what of them the model's slopes cannot follow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.special import chdtrc

from mrctl.discover.fits.screen import ranges_of
from mrctl.discover.fits.tangent import Tangent
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.noise import correlation_inflation

Array = NDArray[np.float64]

USUAL_ZERO, USUAL_SCALE = 0.005, 0.01  # of the largest force, and of each: how far a rig's usually scatter


@dataclass(frozen=True, eq=False)
class Own:
    """Values (runs), how far each beside their mean is in doubt (STD), and the chance that all are alike."""

    values: Array
    doubts: Array
    chance: float


@dataclass(frozen=True, eq=False)
class RunsOwn:
    """Zeros in N and scales as shares of the force, drawn towards none by what is usual.

    left: what the model would leave without these zeros, as a share of the mean square that it leaves.
    """

    zeros_n: Own
    scales: Own
    left: float

    @classmethod
    def of(cls, fit: JointFit) -> RunsOwn:
        """Those of the records that a model is fitted to."""
        tangent = Tangent.of(fit)
        modelled = fit.model.predict(fit.theta)
        ones = tangent.blocks([np.ones(f.size) for f in modelled])
        waves = tangent.blocks(modelled)
        ends = np.cumsum([block.size for block in ones])[:-1]
        rests, slopes = np.split(tangent.residual, ends), np.split(tangent.slopes, ends, axis=1)
        runs = len(rests)
        pairs = [np.stack(pair) for pair in zip(ones, waves, strict=True)]  # (2, n) of each run
        order = np.arange(2 * runs).reshape(runs, 2).T.ravel()  # all zeros, then all scales
        along = np.concatenate([s @ p.T for s, p in zip(slopes, pairs, strict=True)], axis=1)[:, order]
        right = np.concatenate([p @ r for p, r in zip(pairs, rests, strict=True)])[order]
        whole = block_diag(*(p @ p.T for p in pairs))[np.ix_(order, order)]
        beyond = whole - tangent.absorbed(along)
        usual = np.repeat([USUAL_ZERO * ranges_of(fit.model.records).force_n, USUAL_SCALE], runs)
        spread = np.linalg.inv(beyond + np.diag(usual**-2.0))
        by_noise = spread @ beyond @ spread
        values = spread @ right
        answer = tangent.answer(along @ values)
        each = zip(rests, values.reshape(2, runs).T, pairs, slopes, strict=True)
        left = [r - own @ p + answer @ s for r, own, p, s in each]
        loud = np.array([float(r.var()) * correlation_inflation(r) for r in left])
        kinds = np.split(np.arange(2 * runs), 2)
        zeros, scales = (
            _judged(values[k], spread[np.ix_(k, k)], by_noise[np.ix_(k, k)], loud) for k in kinds
        )
        first = slice(runs)
        fall = zeros.values @ (2.0 * right[first] - beyond[first, first] @ zeros.values)
        return cls(zeros, scales, 1.0 - float(fall) / max(float(tangent.residual @ tangent.residual), 1e-300))


def _judged(values: Array, spread: Array, by_noise: Array, loud: Array) -> Own:
    """Values of this covariance, of which noise makes a part, as loud in each run as it says (runs).

    What is told of them may be in a few directions only: two runs at one current share what its table made
    up for. So the chance is asked of all together, by what it costs that they be alike.
    """
    less_mean = np.eye(values.size) - 1.0 / values.size
    variances = np.diag(less_mean @ spread @ less_mean) * loud
    inverse = np.linalg.inv(spread)
    alike = inverse.sum(axis=0) / inverse.sum()
    apart = values - float(alike @ values)
    freedom = float(np.trace(inverse @ by_noise)) - float(inverse.sum(axis=0) @ by_noise @ alike)
    cost = float(apart @ inverse @ apart) / max(float(loud.mean()), 1e-300)
    return Own(values, np.sqrt(np.maximum(variances, 1e-300)), float(chdtrc(max(freedom, 1e-3), cost)))
