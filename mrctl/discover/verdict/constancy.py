"""Whether an effect that was found has one size at all conditions, as a true one has.

What only imitates the truth on the average of a campaign would have to be larger where the current is high,
say, and smaller where it is low. So each effect's force is let grow in one half of its conditions and shrink
in the other, while base and effects settle along the fit's tangent: a true effect stays as it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.elsewhere import forces_of
from mrctl.discover.fits.signals import signals_of
from mrctl.discover.fits.tangent import Tangent
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.noise import correlation_inflation
from mrctl.model.effects.base import Effect

Array = NDArray[np.float64]

CHANGES = 0.15  # of the size, up in one half and down in the other: more, and it is another effect
SURE = 3.5  # standard errors
SEEN = 0.02  # share of the change's square that the model cannot make up for, to be judged
LEAST_SPREAD = 1e-6  # of a signal's largest value: steadier is constant
SIZES = ("velocity", "stroke", "acceleration", "current rate")  # whose sign does not matter here
LEVELS = ("current", "temperature", "time", "energy")
BY_RUN = ("velocity", "stroke", "current", "frequency")


@dataclass(frozen=True, slots=True)
class Change:
    """An effect's size where a signal is high, relative to its size on the whole; 2 less that where low."""

    effect: str
    signal: str
    where_high: float
    error: float  # standard error

    @property
    def size(self) -> float:
        """How far from one size, up or down."""
        return abs(self.where_high - 1.0)

    @property
    def certain(self) -> bool:
        """Whether it is too large for one effect, and no chance."""
        return self.size > max(CHANGES, SURE * self.error)

    @property
    def words(self) -> str:
        """What the effect would have to be."""
        high, low = self.where_high, 2.0 - self.where_high
        where, ratio = ("high", high / max(low, 1e-9)) if high > low else ("low", low / max(high, 1e-9))
        times = f"{ratio:.1f} times as large" if ratio < 10.0 else "there only"
        return f"{self.effect} would have to be {times} where the {self.signal} is {where}"


def changes_of(fit: JointFit, chosen: Sequence[Effect]) -> list[Change]:
    """How the chosen effects' sizes change with conditions, the surest first.

    Signals over which an effect's form is one of many (`Effect.shape_over`) are left out: there, another size
    means another shape.
    """
    tangent = Tangent.of(fit)
    signals = _signals(tangent)
    changes = [change for effect in chosen for change in _of_one(tangent, effect, signals)]
    # The error is 0 of data without noise.
    return sorted(changes, key=lambda c: -min(c.size / CHANGES, 1.0) * c.size / max(c.error, 1e-12))


def _of_one(tangent: Tangent, effect: Effect, signals: Sequence[tuple[str, Array]]) -> Iterator[Change]:
    force = tangent.stacked(forces_of(tangent.fit, {effect.name}))
    square = force**2
    whole = float(square.sum())
    if whole <= 0.0:
        return
    for name, signal in signals:
        if name in effect.shape_over:
            continue
        order = np.argsort(signal, kind="stable")
        half = order[int(np.searchsorted(np.cumsum(square[order]), 0.5 * whole)) :]
        change = -force
        change[half] = force[half]
        beyond = tangent.beyond(change)
        seen = float(beyond @ beyond)
        if seen > SEEN * whole:
            up = float(beyond @ tangent.residual) / seen
            rest = tangent.residual - up * beyond
            variance = correlation_inflation(rest) * float(np.mean(rest**2))
            yield Change(effect.name, name, 1.0 + up, float(np.sqrt(variance / seen)))


def _signals(tangent: Tangent) -> list[tuple[str, Array]]:
    """Each signal that changes, by sample and by run, at the samples that the tangent has."""
    model, theta = tangent.fit.model, tangent.fit.theta
    by_sample: dict[str, list[Array]] = {}
    by_run: dict[str, list[Array]] = {}
    for record, force, skip in zip(model.records, model.predict(theta), tangent.skips, strict=True):
        own = {name: model.weighed(record, x)[skip:] for name, x in signals_of(record, force).items()}
        own["stroke"] = own["stroke"] - np.mean(own["stroke"])
        for name in SIZES + LEVELS:
            by_sample.setdefault(name, []).append(np.abs(own[name]) if name in SIZES else own[name])
        rms = {name: float(np.sqrt(np.mean(own[name] ** 2))) for name in SIZES}
        run = rms | {
            "current": float(np.mean(own["current"])),
            "frequency": rms["acceleration"] / max(rms["velocity"], 1e-12),
        }
        for name in BY_RUN:
            by_run.setdefault(name, []).append(np.full(own["velocity"].size, run[name]))
    found = [(n, np.concatenate(x)) for group in (by_sample, by_run) for n, x in group.items()]
    return [(n, x) for n, x in found if np.ptp(x) > LEAST_SPREAD * float(np.max(np.abs(x)))]
