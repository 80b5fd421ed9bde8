"""What the models and current maps of others make of the same runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.baselines import BaselineFit, fit_baselines
from mrctl.measurements.run import Campaign
from mrctl.model.baselines.liu import LiuMap
from mrctl.model.baselines.reader import ReaderInverse
from mrctl.model.damper import Damper
from mrctl.verify.signals import Signals, on_clock

Array = NDArray[np.float64]


class Map(Protocol):
    """What turns a wished force into a current, sample by sample."""

    def reset(self, force_wish_n: float = 0.0, current_a: float = 0.0) -> None:
        """Start anew."""

    def step(self, force_wish_n: float, velocity_m_s: float, temperature_c: float) -> float:
        """The current in A."""


@dataclass(frozen=True, slots=True, eq=False)
class Others:
    """forward_percent (runs) by model; asked_a: by current map, every run's current in A (n each)."""

    fits: tuple[BaselineFit, ...]
    forward_percent: Mapping[str, Array]
    asked_a: Mapping[str, tuple[Array, ...]]


def others_of(
    campaign: Campaign,
    signals: Sequence[Signals],
    separable: Damper,
    progress: Callable[[float, str], None] = lambda _share, _what: None,
) -> Others:
    """Fit the models, and ask the two that have an inverse for the current of each run's force.

    separable: the damper that the published method found; Reader's inverse takes f and g from it, and the
    low-pass nearest to its filter, as Eq. 3.1 to 3.4 do. Liu's map takes the parameters of Liu's fit.
    """
    fits = fit_baselines(campaign, progress=lambda done, total, what: progress(0.8 * done / total, what))
    forward = {
        fit.name: np.array(
            [
                s.percent(on_clock(run, s.record, fit.predict(run)))
                for s, run in ((s, campaign.runs[s.record.run]) for s in signals)
            ]
        )
        for fit in fits
    }
    liu = next(fit for fit in fits if fit.name == "Liu").parameters
    given = {
        "viscous_length_m": liu["viscous_length"].value,
        "field_force_n": liu["field_force"].value,
        "exponent": liu["exponent"].value,
    }
    progress(0.8, "the inverses of others")
    maps: dict[str, Callable[[float], Map]] = {
        "Reader": lambda dt_s: ReaderInverse(separable, dt_s),
        "Liu": lambda dt_s: LiuMap(separable, dt_s, given),
    }
    asked = {name: tuple(_asked(make(s.dt_s), s) for s in signals) for name, make in maps.items()}
    return Others(tuple(fits), forward, asked)


def _asked(made: Map, s: Signals) -> Array:
    made.reset(float(s.wish_n[0]), float(s.current_a[0]))
    rows = zip(s.wish_n.tolist(), s.velocity_m_s.tolist(), s.temperature_c.tolist(), strict=True)
    return np.array([made.step(*row) for row in rows])
