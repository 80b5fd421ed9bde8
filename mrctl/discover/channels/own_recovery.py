"""Runs that each begin with another share of their force, which comes back with the way: no warmth, then.

Particles settle by how long a damper has stood, and are mixed again as the piston moves. A warmth that each
run begins with, and that cools, may stand in for that: the runs say which of the two they follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.batch import Batch
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit

Array = NDArray[np.float64]

WAYS = (0.1, 0.3, 1.0)  # of the longest run's, after which most of it has come back
CLEARLY = 0.85  # of the square sum: it was 0.93 where a true warmth was not yet fitted to its end


@dataclass
class _OwnColumns(JointModel):
    """A joint model each of whose records has columns of force of its own size, by which nothing is told."""

    columns: list[Array] = field(init=False, repr=False, default_factory=list)  # of each record, (k, blocks)

    def told(self, batch: Batch, roots: Array, x: Array) -> Array:
        """As the plain model's, less what the record's own columns can take."""
        whole = super().told(batch, roots, x)
        parts = zip(batch.records, batch.blocks(roots), batch.blocks(whole), strict=True)
        for k, root, part in parts:
            np.copyto(part, _beyond(part, root * self.columns[k]))
        return whole


def recovers_instead(before: JointFit, warm: JointFit) -> bool:
    """Whether runs with a scale and a recovery of their own each leave clearly less than a warm model.

    before: the model without warmth; warm: that with it, its runs as warm at their starts as it finds. Each
    of these may have a scale of its own, too.
    """
    left = [_square_sum(warm, [f[None] for f in _weighed_forces(warm)])]
    ways = [np.cumsum(np.abs(r.velocity_m_s)) / r.rate_hz for r in before.model.records]
    longest = max(float(way[-1]) for way in ways)
    for share in WAYS if longest > 0.0 else ():
        back = [np.exp(-way / (share * longest)) for way in ways]
        left.append(_with_own(before, back))
    return min(left[1:], default=np.inf) < CLEARLY * left[0]


def _with_own(fit: JointFit, courses: Sequence[Array]) -> float:
    """The square sum that the model leaves, fitted beside a scale of each record and its course (n)."""
    plain = fit.model
    model = _OwnColumns(plain.layout, plain.records, plain.effects, plain.minimum_phase, plain.slowest_pole)
    model.weigh_as(plain)
    forces = plain.predict(fit.theta)
    model.columns = [
        np.stack([model.weighed(r, f), model.weighed(r, f * course)])
        for r, f, course in zip(plain.records, forces, courses, strict=True)
    ]
    beside = model.fit(fit.theta, penalties=fit.penalties, free=fit.moving, rounds=1)
    return _square_sum(beside, model.columns)


def _weighed_forces(fit: JointFit) -> list[Array]:
    model = fit.model
    return [model.weighed(r, f) for r, f in zip(model.records, model.predict(fit.theta), strict=True)]


def _square_sum(fit: JointFit, columns: Sequence[Array]) -> float:
    """Of what a fit leaves, in N², less what each record's own columns (k, blocks) can take."""
    rests = fit.model.residuals(fit.theta)
    beyond = (_beyond(e, own[:, -e.size :]) for e, own in zip(rests, columns, strict=True))
    return sum(float(one @ one) for one in beyond)


def _beyond(x: Array, columns: Array) -> Array:
    """What of x (..., blocks) columns (k, blocks) cannot make."""
    across = np.linalg.qr(columns.T)[0]
    return np.asarray(x - (x @ across) @ across.T, dtype=np.float64)
