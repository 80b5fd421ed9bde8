"""A base from nothing beside an effect: for what the base that was fitted without it leads astray.

A filter and a shape that have made up for an effect lie in another valley than those beside it, and a joint
fit that begins with them stays there. On few knots and few records there is but one valley to speak of.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE
from mrctl.discover.fits.screen import ranges_of
from mrctl.identify import hysteresis
from mrctl.identify.best import ROUGH_KNOTS, coarser, enough, few, moved
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.start import layout_for, start_values
from mrctl.model.effects.base import Effect, Vector

Array = NDArray[np.float64]

MOST = 3  # that a fit goes on from
LAG_HZ = 10.0
TABLES, BASE, BOTH = 6, 8, 12  # iterations of each: behind a plain lag, with the filter, with the effect
TOLERANCE = 1e-3  # share of the cost that another one must win


def best_anew(fit: JointFit, effect: Effect, heat: Callable[..., JointFit]) -> list[Array]:
    """The vectors, best first, of those bases beside an effect from which its other parameters may join.

    heat: as `JointModel.fit` of the model with the effect, on a few records.
    """
    points = effect.starting_points(ranges_of(fit.model.records))
    begins = [begun_anew(fit, effect, point) for point in points]
    needed = np.concatenate([fit.moving, effect.needed])
    heats = [
        heat(theta, free=needed, iterations=2 * HEAT, tolerance=HEAT_TOLERANCE, passing=True)
        for theta in begins
    ]
    return [one.theta for one in sorted(heats, key=lambda one: one.total)[:MOST]]


def begun_anew(fit: JointFit, effect: Effect, point: Vector) -> Array:
    """The vector of a model with one more effect, fitted roughly from a base that knows nothing of this one.

    point: where the effect begins (SI). What is optional of it stays there; the effects that the model has
    already stay as they are.
    """
    chosen = (*fit.model.effects.chosen, effect)
    records = enough([coarser(r) for r in few(fit.model.records)])
    layout = layout_for(records, fit.model.layout.order, velocity_knots=ROUGH_KNOTS)
    model = JointModel(
        layout, records, Effects(chosen), minimum_phase=True, slowest_pole=fit.model.slowest_pole
    )
    base = start_values(JointModel(layout, records))
    part = layout.parts["filter"]
    base[part] = hysteresis.lag(LAG_HZ)
    own = Effects((effect,)).pack({effect.name: effect.within(point)})
    theta = np.concatenate([base, fit.theta[fit.model.layout.size :], own])
    whole = np.arange(theta.size) < layout.size
    tables, both = whole.copy(), whole.copy()
    tables[part] = False
    both[theta.size - own.size :] = effect.needed
    for free, iterations in ((tables, TABLES), (whole, BASE), (both, BOTH)):
        theta = model.fit(theta, rounds=1, iterations=iterations, tolerance=TOLERANCE, free=free).theta
        model.reweigh(theta)
    there = fit.model.layout.pack(moved(layout.unpack(theta[: layout.size]), layout, fit.model.layout))
    return np.concatenate([there, theta[layout.size :]])
