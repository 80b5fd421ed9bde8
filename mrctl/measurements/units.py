"""Units, converted at the door: what measuring systems write, and what mrctl counts in (SI and degC)."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit: value in SI = factor * value + offset. `si` is the SI unit that it measures in."""

    si: str
    factor: float
    offset: float = 0.0


_INCH = 0.0254
_POUND_FORCE = 4.4482216152605
_GRAVITY = 9.80665

_TABLE = {
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0},
    "m": {
        "m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6,
        "in": _INCH, "inch": _INCH, "ft": 12 * _INCH,
    },
    "m/s": {
        "m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "in/s": _INCH, "inch/s": _INCH, "ft/s": 12 * _INCH,
        "km/h": 1 / 3.6,
    },
    "m/s^2": {
        "m/s^2": 1.0, "m/s2": 1.0, "m/s²": 1.0, "mm/s^2": 1e-3, "mm/s2": 1e-3, "cm/s^2": 1e-2,
        "in/s^2": _INCH, "g": _GRAVITY,
    },
    "N": {"N": 1.0, "kN": 1e3, "daN": 10.0, "MN": 1e6, "lbf": _POUND_FORCE, "kgf": _GRAVITY, "kp": _GRAVITY},
    "A": {"A": 1.0, "mA": 1e-3},
}  # fmt: skip
_TEMPERATURES = {
    ("degC", "C", "°C", "celsius"): Unit("degC", 1.0),
    ("degF", "F", "°F", "fahrenheit"): Unit("degC", 5 / 9, -32 * 5 / 9),
    ("K", "kelvin"): Unit("degC", 1.0, -273.15),
}
UNITS = MappingProxyType(
    {name: Unit(si, factor) for si, names in _TABLE.items() for name, factor in names.items()}
    | {name: unit for names, unit in _TEMPERATURES.items() for name in names}
)
"""Every unit by its name. Volts are none: they need a scale that says what a volt is."""


def units_of(si: str) -> list[str]:
    """The names of all units that measure the same as the SI unit `si`."""
    return [name for name, unit in UNITS.items() if unit.si == si]
