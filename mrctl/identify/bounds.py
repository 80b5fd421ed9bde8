"""Bounds of the base model's parameters: f rises, g has the velocity's sign, poles are within reach."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.hysteresis import UNIT_RAD_S
from mrctl.identify.layout import Layout

Array = NDArray[np.float64]

FASTEST_POLE = 0.8 * np.pi / UNIT_RAD_S  # times the sample rate
SLOWEST_POLE = 0.02  # 0.2 Hz
LEAST_DAMPED = 50.0  # half the inverse of a pair's damping


def base_bounds(
    layout: Layout, rate_hz: float, slowest_pole: float, *, minimum_phase: bool
) -> tuple[Array, Array]:
    """Lower and upper bound of each parameter of a layout, in its own units.

    rate_hz: the records' highest, slowest_pole: in UNIT_RAD_S, minimum_phase: the numerator stays positive.
    """
    lower, upper = np.full(layout.size, -np.inf), np.full(layout.size, np.inf)
    parts = layout.parts
    steps = np.diff(layout.current_a, prepend=layout.current_a[0] - 1.0)
    lower[parts["f"]] = 1e-4 * steps
    sign = np.sign(layout.velocity_m_s[layout.free_g])
    at = np.arange(parts["g"].start, parts["g"].stop)
    lower[at[sign > 0]], upper[at[sign < 0]] = 1e-6, -1e-6
    for name in ("h_on", "h_off"):
        lower[parts[name]], upper[parts[name]] = np.log(0.05), np.log(20.0)
    if layout.free_blend:
        low, high = float(layout.current_a[0]), float(layout.current_a[-1])
        lower[parts["blend"]] = low, layout.earliest_on_a
        upper[parts["blend"]] = layout.latest_off_a, high
    order = layout.order
    top = FASTEST_POLE * rate_hz
    poles = np.arange(parts["filter"].start, parts["filter"].start + order)
    slowest = np.log(slowest_pole)
    lower[poles], upper[poles] = slowest, np.log(top)
    if order >= 2:
        lower[poles[-1]], upper[poles[-1]] = 2 * slowest, 2 * np.log(top)
        upper[poles[-2]] = np.log(LEAST_DAMPED * top)
    if minimum_phase:
        lower[parts["filter"].stop - order : parts["filter"].stop] = 0.0
    return lower, upper
