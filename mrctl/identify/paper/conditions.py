"""Which runs share a current, and which a temperature: what the paper's protocol had by design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.errors import InputError
from mrctl.identify.paper.backbone import Backbones
from mrctl.identify.paper.prepare import Preparation

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

LEVEL_A = 0.1  # currents nearer than this are one level, in a campaign that goes to an ampere or more
LEVEL_SHARE = 0.1  # of the largest current, in one that does not
LEVEL_C = 3.0  # temperatures nearer than this are one level
ON_A = (
    0.5  # from here on the damper is on, where the coil takes an ampere or more; else from half its largest
)
OFF_SHARE = 0.02  # of the largest current: below it the damper is off


@dataclass(frozen=True, slots=True, eq=False)
class Conditions:
    """The levels of current and temperature; runs by their place in the preparation.

    current_a (C), temperature_c (K): the levels, increasing; current, temperature (runs): each run's level.
    nominal: the coldest level of temperature that all currents have seen, the paper's room temperature.
    reference (C): the run of each current that is nearest to it.
    off (C): no current flows; on (C): the paper's 1, 2 and 3 A.
    """

    current_a: Array
    temperature_c: Array
    current: Indices
    temperature: Indices
    nominal: int
    reference: Indices
    off: NDArray[np.bool_]
    on: NDArray[np.bool_]

    def runs_at(self, current: int) -> Indices:
        """The runs of a current level."""
        return np.flatnonzero(self.current == current)

    def on_share(self) -> Array:
        """How far on each current level is (C), 0 to 1: linear between the off and the on levels."""
        first = float(self.current_a[self.on][0])
        share = np.where(self.on, 1.0, np.clip(self.current_a / first, 0.0, 1.0))
        return np.where(self.off, 0.0, share)


def conditions(preparation: Preparation, backbones: Backbones) -> Conditions:
    """Sort the runs by current and temperature.

    Raises InputError where only one current was measured: f(i) is then a point.
    """
    measured_a = np.array([r.current_a for r in preparation.records])
    largest = float(measured_a.max())
    current_a, current = levels(measured_a, min(LEVEL_A, LEVEL_SHARE * largest))
    temperature_c, temperature = levels(np.array([r.temperature_c for r in preparation.records]), LEVEL_C)
    if current_a.size < 2:
        raise InputError.at(
            preparation.root,
            f"all usable runs are at {largest:.3g} A, the paper's method needs two currents for f(i)",
            "measure another current too, or use `--method best`",
        )
    coldest = [int(np.min(temperature[current == c])) for c in range(current_a.size)]
    nominal = max(coldest)
    reach = np.sum(np.isfinite(backbones.force_n), axis=1)
    reference = []
    for c in range(current_a.size):
        runs = np.flatnonzero(current == c)
        away = np.abs(temperature_c[temperature[runs]] - temperature_c[nominal])
        reference.append(runs[np.lexsort((-reach[runs], away))[0]])
    return Conditions(
        current_a=current_a,
        temperature_c=temperature_c,
        current=current,
        temperature=temperature,
        nominal=nominal,
        reference=np.array(reference, dtype=np.intp),
        off=current_a <= OFF_SHARE * largest,
        on=current_a >= min(ON_A, 0.5 * largest),
    )


def levels(values: Array, width: float) -> tuple[Array, Indices]:
    """Values that lie together within a width, as their means (increasing), and each value's level."""
    order = np.argsort(values, kind="stable")
    place = np.zeros(values.size, dtype=np.intp)
    level, start = 0, float(values[order[0]])
    for k in order:
        if values[k] - start > width:
            level, start = level + 1, float(values[k])
        place[k] = level
    return np.bincount(place, values) / np.bincount(place), place
