"""A base from nothing beside an effect: for what the base that was fitted without it leads astray.

A filter and a shape that have made up for an effect lie in another valley than those beside it, and a joint
fit that begins with them stays there. On few knots and few records there is but one valley to speak of.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.race import HEAT, HEAT_TOLERANCE, heats_of
from mrctl.discover.fits.screen import ranges_of
from mrctl.identify import hysteresis
from mrctl.identify.best import ROUGH_KNOTS, coarser, few, moved
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.processes import in_processes
from mrctl.identify.records import Record
from mrctl.identify.start import layout_for, start_values
from mrctl.model.effects.base import Effect, Vector

Array = NDArray[np.float64]

ENOUGH = 8000  # samples of all records
FAST, CLEARLY = 0.3, 1.1  # of a record's top speed, where a part may begin; times what its beginning says
MOST = 3  # that a fit goes on from
LAG_HZ = 10.0
TABLES, BASE, BOTH = 6, 8, 12  # iterations of each: behind a plain lag, with the filter, with the effect
TOLERANCE = 1e-3  # share of the cost that another one must win


def best_anew(fit: JointFit, effect: Effect, heat: Callable[..., JointFit]) -> list[Array]:
    """The vectors, best first, of those bases beside an effect from which its other parameters may join.

    heat: as `JointModel.fit` of the model with the effect, on a few records.
    """
    needed = np.concatenate([fit.moving, effect.needed])
    begun = begun_anew(fit, effect, effect.starting_points(ranges_of(fit.model.records)))
    further = partial(heat, free=needed, iterations=2 * HEAT, tolerance=HEAT_TOLERANCE, passing=True)
    heats = heats_of(further, begun)
    return [one.theta for one in sorted(heats, key=lambda one: one.total)[:MOST]]


def _shortest(records: Sequence[Record]) -> list[Record]:
    """Of each record so long a part that all together are enough."""
    most = ENOUGH // len(records)
    return [r if len(r) <= most else _part(r, most) for r in records]


def _part(record: Record, length: int) -> Record:
    """The beginning of a record, or the part of that length which says clearly more.

    No other begins where the damper turns: there its past, which nobody knows, says most.
    """
    speed = np.abs(record.velocity_m_s)
    signals = [x for x in (record.velocity_m_s, record.current_a) if np.ptp(x) > 0.0]

    def covered(begin: int) -> float:
        return sum(float(np.ptp(x[begin : begin + length]) / np.ptp(x)) for x in signals)

    later = np.arange(length // 4, len(record) - length + 1, max(length // 4, 1))
    fast = later[speed[later] > FAST * speed.max()].tolist()
    best = max([0, *fast], key=covered)
    begin = best if covered(best) > CLEARLY * covered(0) else 0
    return record.part(begin, begin + length)


def begun_anew(fit: JointFit, effect: Effect, points: Sequence[Vector]) -> list[Array]:
    """The vectors of a model with one more effect, fitted roughly from a base that knows nothing of this one.

    points: where the effect begins (SI), for one vector each. What is optional of it stays there; the effects
    that the model has already stay as they are.
    """
    plain = fit.model
    records = _shortest([coarser(r) for r in few(plain.records)])
    layout = layout_for(records, plain.layout.order, velocity_knots=ROUGH_KNOTS)
    part = layout.parts["filter"]
    base = start_values(JointModel(layout, records))
    base[part] = hysteresis.lag(LAG_HZ)
    found = fit.theta[plain.layout.size :]
    chosen, alone = Effects((*plain.effects.chosen, effect)), Effects((effect,))
    whole = np.arange(layout.size + chosen.size) < layout.size
    tables, both = whole.copy(), whole.copy()
    tables[part] = False
    both[layout.size + found.size :] = effect.needed

    def begun(point: Vector) -> Array:
        model = JointModel(layout, records, chosen, minimum_phase=True, slowest_pole=plain.slowest_pole)
        theta = np.concatenate([base, found, alone.pack({effect.name: effect.within(point)})])
        for free, iterations in ((tables, TABLES), (whole, BASE), (both, BOTH)):
            theta = model.fit(theta, rounds=1, iterations=iterations, tolerance=TOLERANCE, free=free).theta
            model.reweigh(theta)
        there = plain.layout.pack(moved(layout.unpack(theta[: layout.size]), layout, plain.layout))
        return np.concatenate([there, theta[layout.size :]])

    return in_processes(begun, points)
