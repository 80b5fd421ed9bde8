"""From what the steps found to the tables of a calibration: complete, and fit to be inverted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.errors import InputError
from mrctl.identify.paper.backbone import Backbones
from mrctl.identify.paper.conditions import LEVEL_C, Conditions
from mrctl.identify.paper.prepare import Preparation
from mrctl.identify.paper.separable import Collapse, Temperature
from mrctl.model.static import StaticTables, static_tables, transition_increases
from mrctl.model.tables import strictly_increasing

Array = NDArray[np.float64]


def model_tables(
    preparation: Preparation, backbones: Backbones, at: Conditions, collapsed: Collapse, h: Temperature
) -> tuple[StaticTables, tuple[str, ...]]:
    """f, g and h as tables, and notes on all that was assumed. Raises InputError where f has no inverse."""
    notes: list[str] = []
    current, force = _current_table(at, collapsed.f_n / h.shift, notes)
    if not strictly_increasing(force.tolist()):
        raise InputError.at(
            preparation.root,
            "f(i) does not increase: "
            + ", ".join(f"{f:.4g} N at {i:.3g} A" for i, f in zip(current, force, strict=True)),
            "the inverse needs a force that grows with every current: leave out the runs of the current that "
            "does not add, or use `--method best`",
        )
    velocity, shape = _velocity_table(preparation, backbones.velocity_m_s, collapsed.g, notes)
    temperature, on, off = _temperature_table(at, h, notes)
    first_on = float(at.current_a[at.on][0])

    def tables(off_below_a: float, on_above_a: float) -> StaticTables:
        return static_tables(
            current.tolist(),
            force.tolist(),
            velocity.tolist(),
            shape.tolist(),
            temperature.tolist(),
            off.tolist(),
            on.tolist(),
            off_below_a,
            on_above_a,
        )

    if not at.off.any():
        return tables(0.0, 0.0), tuple(notes)
    blended = tables(0.0, first_on)
    if transition_increases(blended):
        return blended, tuple(notes)
    notes.append(
        f"h falls so steeply from off to on that the force would fall on the way to {first_on:.3g} A: "
        "it switches there"
    )
    return tables(first_on, first_on), tuple(notes)


def _current_table(at: Conditions, f_n: Array, notes: list[str]) -> tuple[Array, Array]:
    """The table of f, from 0 A upwards."""
    current, force = at.current_a.copy(), f_n.copy()
    if at.off[0]:
        current[0] = 0.0
        return current, force
    slope = (force[1] - force[0]) / (current[1] - current[0])
    first = float(np.clip(force[0] - slope * current[0], 0.1 * force[0], 0.9 * force[0]))
    notes.append(
        f"no run without current: f at 0 A, {first:.3g} N, goes on from the next two currents; "
        "h without current is h with current"
    )
    return np.append(0.0, current), np.append(first, force)


def _velocity_table(
    preparation: Preparation, velocity: Array, g: Array, notes: list[str]
) -> tuple[Array, Array]:
    """The table of g with its zero at zero, as the inverse needs it."""
    seen = np.isfinite(g)
    velocity, g = velocity[seen], g[seen]
    wrong = velocity * g < 0.0
    if np.sum(wrong) > 0.5 * wrong.size:
        raise InputError.at(
            preparation.root,
            "force and velocity have opposite signs",
            "both are positive in extension here: turn one of them around",
        )
    if wrong.any():
        reach = float(np.max(np.abs(velocity[wrong])))
        notes.append(
            f"g has the wrong sign in {int(wrong.sum())} bins up to {reach:.3g} m/s and is set to 0 there: "
            "a constant or a spring force acts, which the paper's model does not have"
        )
    g = np.where(wrong, 0.0, g)
    apart = np.abs(velocity) > 1e-9
    velocity, g = velocity[apart], g[apart]
    place = int(np.searchsorted(velocity, 0.0))
    return np.insert(velocity, place, 0.0), np.insert(g, place, 0.0)


def _temperature_table(at: Conditions, h: Temperature, notes: list[str]) -> tuple[Array, Array, Array]:
    """The tables of h, at two temperatures or more."""
    if at.temperature_c.size > 1:
        return at.temperature_c, h.on, h.off
    notes.append(f"all runs are within {LEVEL_C:g} degC: h(i, T) is 1; measure warmer and colder to find it")
    only = float(at.temperature_c[0])
    return np.array([only - 0.5 * LEVEL_C, only + 0.5 * LEVEL_C]), np.ones(2), np.ones(2)
