"""Before any search: which effects this campaign could show at all, at their usual size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.screen import Look
from mrctl.identify.layout import Layout, Tables
from mrctl.model.effects.base import Stage

Array = NDArray[np.float64]

LEAST_SIGNAL = 30.0  # square sum in units of the noise that an effect of usual size must leave
FAST_SHARE = 0.3  # of the speed that both directions reach: below, hysteresis blurs the tables
SEEN_SHARE = 0.02  # of the force, by which the directions differ before it is said
OWN = "one that is alike at all currents is the base model's own"


def taken_up(hidden: dict[str, str], layout: Layout, tables: Tables) -> dict[str, str]:
    """The same reasons; where g itself has what an asymmetry would have been for, with how much that is."""
    change = compression_change(layout, tables)
    if abs(change) < SEEN_SHARE:
        return hidden
    more = "more" if change > 0.0 else "less"
    why = hidden.get("rebound_asymmetry", OWN)
    words = f"{why}; g damps compression {100.0 * abs(change):.2g} % {more} than rebound"
    return hidden | {"rebound_asymmetry": words}


def compression_change(layout: Layout, tables: Tables) -> float:
    """How much more g damps compression than rebound at the same speed, as a share of rebound; the mean."""
    knots = layout.velocity_m_s
    reach = min(float(knots[-1]), -float(knots[0]))
    if reach <= 0.0:
        return 0.0
    speed = np.linspace(FAST_SHARE * reach, reach, 20)
    rebound, compression = (np.interp(v, knots, tables.g) for v in (speed, -speed))
    return float(np.mean(-compression / rebound)) - 1.0


def hidden_effects(looks: list[Look], colour: float, *, steady: bool) -> dict[str, str]:
    """Effects that this campaign cannot show, and why; `colour`: samples that count as one.

    steady: whether the current is, in every run.
    """
    result = {}
    for look in looks:
        name = look.effect.name
        if look.usual_force <= 0.0:
            result[name] = "at its usual size it makes no force here: nothing in these runs excites it"
        elif look.usual_beyond >= LEAST_SIGNAL * colour:
            continue
        elif steady and look.effect.stage is Stage.CURRENT:
            result[name] = "the current is steady in every run"
        else:
            share = 100.0 * (1.0 - look.usual_beyond / look.usual_force)
            result[name] = (
                f"the base model's own tables and filter take up {min(share, 100.0):.4g} % of it, "
                "and the rest is below the noise"
            )
    return result
