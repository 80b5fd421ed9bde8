"""What a model is taken to be where nothing is measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.layout import Layout, Tables

Array = NDArray[np.float64]


def neutral(layout: Layout) -> Array:
    """What the parameters are taken to be where nothing is measured: h = 1, H = a lag at 30 Hz."""
    knots = layout.velocity_m_s
    top = abs(knots[layout.gauge])
    g = np.tanh(knots / (0.25 * top)) / np.tanh(1.0 / 0.25)
    count = layout.current_a.size
    f = np.linspace(0.3, 1.0, count) * layout.force_scale_n if count > 1 else np.array([layout.force_scale_n])
    ones = np.ones(layout.temperature_c.size)
    return layout.pack(
        Tables(f, g, ones, ones.copy(), layout.off_below_a, layout.on_above_a, neutral_filter(layout.order))
    )


def neutral_filter(order: int) -> Array:
    """Poles around 30 Hz, numerator halfway between a pure lag and none."""
    p = np.log(3.0)
    poles = {0: [], 1: [p], 2: [p - np.log(2.0), 2 * p], 3: [p, p - np.log(2.0), 2 * p]}[order]
    return np.array([*poles, *([0.3] * order)])
