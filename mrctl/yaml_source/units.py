"""What to do with a value in a unit that does not fit."""

from __future__ import annotations

# (given, wanted) -> how a value is converted
_CONVERSIONS = {
    ("mm/s", "m/s"): "divide the values by 1000",
    ("cm/s", "m/s"): "divide the values by 100",
    ("in/s", "m/s"): "multiply the values by 0.0254",
    ("ft/s", "m/s"): "multiply the values by 0.3048",
    ("km/h", "m/s"): "divide the values by 3.6",
    ("mA", "A"): "divide the values by 1000",
    ("mA/s", "A/s"): "divide the values by 1000",
    ("A/ms", "A/s"): "multiply the values by 1000",
    ("kN", "N"): "multiply the values by 1000",
    ("daN", "N"): "multiply the values by 10",
    ("lbf", "N"): "multiply the values by 4.4482216",
    ("lb", "N"): "multiply the values by 4.4482216",
    ("kgf", "N"): "multiply the values by 9.80665",
    ("degF", "degC"): "subtract 32 and multiply by 5/9",
    ("F", "degC"): "subtract 32 and multiply by 5/9",
    ("°F", "degC"): "subtract 32 and multiply by 5/9",
    ("K", "degC"): "subtract 273.15 from the values",
    ("kHz", "Hz"): "multiply the value by 1000",
    ("rad/s", "Hz"): "divide the value by 2 pi",
    ("1/s", "Hz"): "",
    ("%", "1"): "divide the values by 100",
    ("C", "degC"): "",
    ("°C", "degC"): "",
    ("deg C", "degC"): "",
    ("celsius", "degC"): "",
    ("Celsius", "degC"): "",
    ("newton", "N"): "",
    ("ampere", "A"): "",
    ("-", "1"): "",
    ("", "1"): "",
}


def unit_mend(given: object, wanted: str) -> str:
    """The mend for a wrong unit: the wanted one, and how to convert where that is known."""
    write = f"write unit: {wanted}" if wanted != "1" else 'write unit: "1"'
    conversion = _CONVERSIONS.get((str(given), wanted))
    if conversion:
        return f"{conversion} and {write}"
    if conversion == "" or str(given) == wanted:
        return write
    return f"convert the values and {write}"
