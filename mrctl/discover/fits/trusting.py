"""A joint model in which some samples count less than others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.batch import Batch
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit

Array = NDArray[np.float64]

TOLERANCE = 1e-3


@dataclass
class _Trusting(JointModel):
    """The joint model with a weight for each sample."""

    trust: list[Array] = field(default_factory=list)  # square roots, (n) each, start included

    def residuals(self, theta: Array) -> list[Array]:
        plain = super().residuals(theta)
        return [t[t.size - r.size :] * r for t, r in zip(self.trust, plain, strict=True)]

    def block_weights(self, batch: Batch, theta: Array) -> Array:
        roots = super().block_weights(batch, theta)
        for k, own in zip(batch.records, batch.blocks(roots), strict=True):
            np.multiply(own, self.trust[k], out=own)
        return roots


def fitted_trusting(
    fit: JointFit,
    theta: Array,
    trust: Sequence[Array],
    iterations: int,
    *,
    free: NDArray[np.bool_] | None = None,
    tolerance: float = TOLERANCE,
) -> JointFit:
    """Where a fit from theta ends in which the weighed samples of each record count as much as is trusted.

    trust: square roots of the samples' weights, 0 to 1, (n) for each record. free: which parameters move.
    tolerance: share of the cost that another step must win.
    """
    model = fit.model
    trusting = _Trusting(
        model.layout,
        model.records,
        model.effects,
        model.minimum_phase,
        model.slowest_pole,
        trust=list(trust),
    )
    trusting.weigh_as(model)
    return trusting.fit(
        theta,
        penalties=fit.penalties,
        free=free,
        rounds=1,
        iterations=iterations,
        tolerance=tolerance,
        passing=True,
    )


def as_plain(fit: JointFit, theta: Array) -> JointFit:
    """That place as a fit of the plain model, in which all samples count alike."""
    solution = replace(fit.solution, theta=theta, normal=fit.model.normal(theta))
    return JointFit(fit.model, solution, fit.penalties)
