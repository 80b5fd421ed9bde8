"""How numbers are written for people: significant figures, units, dashes for what is not known."""

from __future__ import annotations

import math
from collections.abc import Sequence

MISSING = "–"
"""What stands where there is no value."""

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_SPELLED = {"degC": "°C", "1": "", "-": "", "ohm": "Ω", "N*s/m": "N·s/m", "m/s^2": "m/s²", "m/s2": "m/s²"}
_LARGEST_PLAIN = 1e6
_SMALLEST_PLAIN = 1e-4


def unit_text(unit: str) -> str:
    """The unit as people write it: `degC` becomes °C; `1` and `-` (no unit) become nothing."""
    return _SPELLED.get(unit, unit)


def decimals_for(value: float, digits: int) -> int:
    """Decimals that show `value` with `digits` significant figures; 0 or more."""
    if value == 0.0 or not math.isfinite(value):
        return max(0, digits - 1)
    # Through the formatted exponent, so that 9.996 counts as 10.0.
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
    return max(0, digits - 1 - exponent)


def format_number(value: float | None, digits: int = 3) -> str:
    """A number with `digits` significant figures: trailing zeros stay, none before the point is lost.

    None and NaN give a dash. From 1e6 up and below 1e-4 the form is 1.23e-05, which can be pasted back.
    """
    if value is None or math.isnan(value):
        return MISSING
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    if hasattr(value, "__index__"):  # a count, numpy's too, is exact
        return str(value)
    value = float(value)
    if value == 0.0:
        return "0"
    if not _SMALLEST_PLAIN <= abs(value) < _LARGEST_PLAIN:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{decimals_for(value, digits)}f}"


def format_column(values: Sequence[float | None], digits: int = 3) -> list[str]:
    """Numbers that stand below each other, with the same decimals: the largest has `digits` figures or more.

    The smallest keeps one figure less if it can; what format_number writes with a power of ten stands alone.
    """
    plain = [abs(v) for v in values if v is not None and _SMALLEST_PLAIN <= abs(v) < _LARGEST_PLAIN]
    if not plain or all(v is None or hasattr(v, "__index__") for v in values):
        return [format_number(v, digits) for v in values]
    fewest = decimals_for(max(plain), digits)
    decimals = min(max(fewest, decimals_for(min(plain), digits - 1)), fewest + 2)
    return [
        f"{v:z.{decimals}f}" if v is not None and (v == 0 or abs(v) in plain) else format_number(v, digits)
        for v in values
    ]


def format_quantity(value: float | None, unit: str = "", digits: int = 3, *, si_prefix: bool = False) -> str:
    """A value with its unit, such as `12.3 N`; with `si_prefix`, 1.2e6 N/m becomes `1.20 MN/m`.

    A missing value is a dash without a unit. A prefix goes before the first unit of a compound only, and
    never before °C, % or kg.
    """
    unit = unit_text(unit)
    if value is None or not math.isfinite(value) or not unit:
        number = format_number(value, digits)
        return number if number in {MISSING, ""} or not unit else f"{number} {unit}"
    if si_prefix and value != 0.0 and unit[0] not in "°%" and not unit.startswith("kg"):
        exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
        thousands = min(max(3 * (exponent // 3), -9), 9)
        return f"{format_number(value / 10.0**thousands, digits)} {_PREFIXES[thousands]}{unit}"
    return f"{format_number(value, digits)} {unit}"


def format_interval(
    value: float | None, low: float | None, high: float | None, unit: str = "", digits: int = 2
) -> str:
    """An estimate with its interval, such as `12.3 (11.9 … 12.7) N`; the interval's width sets the decimals.

    `digits` counts the significant figures of the half width. Without an interval the value stands alone.
    """
    if value is None or not math.isfinite(value):
        return MISSING
    if low is None or high is None or not (math.isfinite(low) and math.isfinite(high)) or high <= low:
        return format_quantity(value, unit)
    unit = unit_text(unit)
    largest = max(abs(value), abs(low), abs(high))
    if not _SMALLEST_PLAIN <= largest < _LARGEST_PLAIN:
        text = f"{value:.3g} ({low:.3g} … {high:.3g})"
    else:
        decimals = min(decimals_for((high - low) / 2, digits), 8)
        text = f"{value:z.{decimals}f} ({low:z.{decimals}f} … {high:z.{decimals}f})"
    return f"{text} {unit}".rstrip()


def format_duration(seconds: float | None) -> str:
    """A time span for people: `0.8 s`, `42 s`, `3 min 05 s`, `2 h 10 min`."""
    if seconds is None or not math.isfinite(seconds):
        return MISSING
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
