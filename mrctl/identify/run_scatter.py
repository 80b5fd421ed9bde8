"""Fits to runs that differ in scale: a real damper is another each run, by its fluid's warmth or its past.

What is in proportion to a run's force then says little: its share scatters from run to run, and a fit that
counts its samples as so many witnesses bends shapes and lags to make up for it. So the share is taken for a
random number of each run, of a spread that the runs show, and what is left counts as before: generalised
least squares with the covariance I + spread² F F' in units of the noise (Laird, Ware, Biometrics 38 (1982)).
And what a real damper has beyond any model comes again in each cycle of a run: it is one witness, not many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from mrctl.identify.batch import Batch
from mrctl.identify.joint import JointModel
from mrctl.identify.noise import SCALE, correlation_inflation, repeated

Array = NDArray[np.float64]

FEWEST_RUNS = 6  # fewer say nothing of a spread, and agree with any rule
CHANCE = 1e-3
LEAST = 0.01  # of the force: less does no harm
LARGEST = 0.05  # and more is the model's error, not the runs'


@dataclass
class ScatteredModel(JointModel):
    """A joint model that finds how far its runs scatter in scale, where each has a noise of its own."""

    spread: float = field(init=False, repr=False, default=0.0)  # of the runs' scales, as a share
    levels: list[Array] = field(init=False, repr=False, default_factory=list)  # each record's force, weighed

    def weigh_as(self, other: JointModel) -> None:
        """As the plain model's; a model of the same kind also says how far the runs scatter."""
        super().weigh_as(other)
        if isinstance(other, ScatteredModel):
            self.spread, self.levels = other.spread, other.levels

    def reweigh(self, theta: Array, *, each: bool = False) -> None:
        """As the plain model's; with `each` also how far the runs scatter, and each cycle's error once."""
        super().reweigh(theta, each=each)
        self.spread, self.levels = 0.0, []
        if each:
            forces = [self.weighed(r, f) for r, f in zip(self.records, self.predict(theta), strict=True)]
            errors = self.residuals(theta)
            self.spread = scale_spread(errors, [f[-e.size :] for f, e in zip(forces, errors, strict=True)])
            self.levels = forces
            motions = (self.weighed(r, r.velocity_m_s) for r in self.records)
            self.weights /= [repeated(v[-e.size :], e) for v, e in zip(motions, errors, strict=True)]

    def told(self, batch: Batch, roots: Array, x: Array) -> Array:
        """As the plain model's, less nearly all of what is in proportion to a run's force."""
        whole = super().told(batch, roots, x)
        if self.spread > 0.0:
            parts = zip(batch.records, batch.blocks(roots), batch.blocks(whole), strict=True)
            for k, root, part in parts:
                along = root * self.levels[k]
                size = float(along @ along)
                if size > 0.0:
                    taken = (1.0 - 1.0 / np.sqrt(1.0 + self.spread**2 * size)) / size
                    np.subtract(part, taken * np.multiply.outer(part @ along, along), out=part)
        return whole


def scale_spread(errors: Sequence[Array], modelled: Sequence[Array]) -> float:
    """How far runs usually scatter in scale beyond chance, as a share of the force; 0 where they do not.

    The middle one of them says so: what a few runs miss by far is their own, as an off state's.

    errors, modelled: what a model leaves of each run's force, and the model's (n each, N).
    """
    if len(errors) < FEWEST_RUNS:
        return 0.0
    apart, doubts, chance = scales_apart(errors, modelled)
    if chance > CHANCE:
        return 0.0
    usual = (SCALE * float(np.median(np.abs(apart)))) ** 2 - float(np.median(doubts)) ** 2
    spread = min(float(np.sqrt(max(usual, 0.0))), LARGEST)
    return spread if spread > LEAST else 0.0


def scales_apart(errors: Sequence[Array], modelled: Sequence[Array]) -> tuple[Array, Array, float]:
    """Each run's scale beside the mean, its standard error (runs each), and the chance that all are alike.

    errors, modelled: what a model leaves of each run's force, and the model's (n each, N).
    """
    found = [_scale_of(e, m) for e, m in zip(errors, modelled, strict=True)]
    shares, doubts = np.array([s for s, _ in found]), np.array([d for _, d in found])
    apart = shares - float(np.average(shares, weights=1.0 / doubts**2))
    return apart, doubts, float(chdtrc(len(errors) - 1, float(np.sum((apart / doubts) ** 2))))


def _scale_of(error: Array, modelled: Array) -> tuple[float, float]:
    """The share of the modelled force that an error (n) holds beside a zero, and its standard error."""
    force = modelled - modelled.mean()
    power = max(float(force @ force), 1e-300)
    share = float(force @ error) / power
    rest = error - error.mean() - share * force
    doubt = float(rest.std()) * np.sqrt(correlation_inflation(rest) / power)
    return share, max(float(doubt), 1e-9)
