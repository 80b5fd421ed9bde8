"""Dampers to try the model on."""

from __future__ import annotations

import math

from mrctl.model.damper import Damper, Span
from mrctl.model.filters import Filter
from mrctl.model.static import StaticTables, static_tables

CURRENT = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0)
FORCE = (290.0, 530.0, 760.0, 980.0, 1180.0, 1430.0, 1640.0, 1830.0, 2000.0)
VELOCITY = tuple(0.381 * k / 20.0 for k in range(-20, 21))
SHAPE = tuple(math.tanh(v / 0.05) * (0.9 + 0.1 * abs(v) / 0.381) for v in VELOCITY)
TEMPERATURE = (28.9, 50.0, 66.1, 82.8)

# Eq. 6.4 and 8.3, corrected.
FORWARD = Filter.of(2000.0, (0.2166, -0.4128, 0.1964), (1.0, -2.738, 2.4986, -0.7604))
INVERSE = Filter.of(2000.0, (3.3755, -2.4550, -3.2812, 2.5493), (1.0, -0.4968, -0.2855, -0.02928))


def tables(
    h_off=(1.0, 0.85, 0.74, 0.655), h_on=(1.0, 0.95, 0.91, 0.875), off_below=0.0, on_above=1.0
) -> StaticTables:
    return static_tables(CURRENT, FORCE, VELOCITY, SHAPE, TEMPERATURE, h_off, h_on, off_below, on_above)


def magneride() -> Damper:
    return Damper(
        static=tables(),
        forward_filter=FORWARD,
        inverse_filter=INVERSE,
        refine_cutoff_hz=80.0,
        current_max_a=3.0,
        current_slew_a_s=400.0,
        velocity_valid_m_s=Span(-0.381, 0.381),
        temperature_valid_c=Span(28.9, 82.8),
        current_valid_a=Span(0.0, 3.0),
    )
