"""Runs that each begin with another share of their force, which comes back with the way: no warmth, then.

Particles settle by how long a damper has stood, and are mixed again as the piston moves. A warmth that each
run begins with, and that cools, may stand in for that: the runs say which of the two they follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.channels.warm_starts import less_scales
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
    ways = [np.cumsum(np.abs(r.velocity_m_s)) / r.rate_hz for r in before.model.records]
    longest = max(float(way[-1]) for way in ways)
    if longest <= 0.0:
        return False
    forces = before.model.predict(before.theta)
    left = []
    for share in WAYS:
        back = [f * np.exp(-way / (share * longest)) for f, way in zip(forces, ways, strict=True)]
        left.append(_square_sum_beside(before, list(zip(forces, back, strict=True))))
    return min(left) < CLEARLY * sum(float(rest @ rest) for rest in less_scales(warm))


def _square_sum_beside(fit: JointFit, own: Sequence[tuple[Array, ...]]) -> float:
    """What the model leaves in N², fitted beside columns (n each) of each record's own."""
    plain = fit.model
    model = _OwnColumns(plain.layout, plain.records, plain.effects, plain.minimum_phase, plain.slowest_pole)
    model.weigh_as(plain)
    model.columns = [
        np.stack([model.weighed(r, x) for x in columns])
        for r, columns in zip(plain.records, own, strict=True)
    ]
    beside = model.fit(fit.theta, penalties=fit.penalties, free=fit.moving, rounds=1)
    rests = zip(model.residuals(beside.theta), model.columns, strict=True)
    beyond = (_beyond(rest, columns[:, -rest.size :]) for rest, columns in rests)
    return sum(float(one @ one) for one in beyond)


def _beyond(x: Array, columns: Array) -> Array:
    """What of x (..., blocks) columns (k, blocks) cannot make."""
    across = np.linalg.qr(columns.T)[0]
    return np.asarray(x - (x @ across) @ across.T, dtype=np.float64)
