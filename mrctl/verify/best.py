"""What the better method makes of the published protocol: forwards, and through the inverse and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.refit import fitted, thinned
from mrctl.identify.best import identify_best
from mrctl.identify.finish import damper_of
from mrctl.identify.paper.validation import Retraced
from mrctl.identify.records import records_of
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper
from mrctl.model.effects.registry import effect
from mrctl.model.pipeline import InversePipeline
from mrctl.simulate import simulate
from mrctl.verify.signals import Signals

Array = NDArray[np.float64]

EFFECTS = ("off_state_backbone", "gas_spring")  # the off state's own shape, and the gas that every damper has


@dataclass(frozen=True, slots=True, eq=False)
class Best:
    """Each (runs): percent of the largest force, forwards, and to the inverse and back.

    runs: the kept samples of each, through the inverse and back; asked_a: the current of the whole run.
    filtered_percent, filtered_mean_a: the same from the force after the published method's low-pass.
    """

    damper: Damper
    forward_percent: Array
    returned_percent: Array
    filtered_percent: Array
    filtered_mean_a: Array
    runs: tuple[Retraced, ...]
    asked_a: tuple[Array, ...]


def best_of(campaign: Campaign, signals: Sequence[Signals]) -> Best:
    """Fit with the effects, then judge every run that the published method kept.

    Forwards against the force as measured, which is what was fitted; back against the wish.
    """
    chosen = [effect(name) for name in EFFECTS]
    begin = {one.name: one.typical for one in chosen}
    base = identify_best(campaign).fit
    damper = damper_of(fitted(thinned(records_of(campaign.runs)), chosen, begin, start=base))
    forward, returned, filtered, means, runs, currents = [], [], [], [], [], []
    for s in signals:
        forward.append(s.percent(force_of(damper, s, s.current_a)))
        back, asked = _retraced(damper, s, s.wish_n)
        returned.append(s.percent(back, s.wish_n))
        runs.append(Retraced(*(s.record.cut(x) for x in (s.wish_n, back, asked))))
        currents.append(asked)
        back, asked = _retraced(damper, s, s.record.force_n)
        filtered.append(s.percent(back, s.record.force_n))
        means.append(float(np.mean(s.record.cut(asked))))
    return Best(
        damper,
        np.array(forward),
        np.array(returned),
        np.array(filtered),
        np.array(means),
        tuple(runs),
        tuple(currents),
    )


def force_of(damper: Damper, s: Signals, current_a: Array) -> Array:
    """The damper's force (n) in N with another current."""
    return simulate(
        damper, s.dt_s, s.velocity_m_s, current_a, s.temperature_c, s.displacement_m, s.acceleration_m_s2
    )


def _retraced(damper: Damper, s: Signals, wish_n: Array) -> tuple[Array, Array]:
    """(force that comes back, current asked for), n each, the current as the controller works it out."""
    inverse = InversePipeline(damper, s.dt_s)
    inverse.reset(float(wish_n[0]))
    signals = (wish_n, s.velocity_m_s, s.temperature_c, s.displacement_m, s.acceleration_m_s2)
    current = np.array([inverse.step(*row) for row in zip(*(x.tolist() for x in signals), strict=True)])
    return force_of(damper, s, current), current
