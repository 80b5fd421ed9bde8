"""Axes: linear and logarithmic scales, limits that show the data, ticks at round numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from mrctl.report.decimate import Floats
from mrctl.report.svg import text_width

_TINIEST = 1e-300
"""Smaller numbers count as zero: they have no full precision."""
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True, slots=True)
class Tick:
    """A place on an axis; without a label it is a fine grid line."""

    value: float
    label: str


@dataclass(frozen=True, slots=True)
class Scale:
    """Data to px along one axis; `end` may lie before `start` (y grows upward)."""

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def __call__(self, values: Floats) -> Floats:
        """Px of the values; what a log axis cannot show becomes NaN."""
        low, high = self.low, self.high
        if self.log:
            values = np.log10(np.where(values > _TINIEST, values, np.nan))
            low, high = math.log10(low), math.log10(high)
        return self.start + (values - low) / (high - low) * (self.end - self.start)

    def at(self, value: float) -> float:
        """Px of one value."""
        return float(self(np.array([value]))[0])

    def ticks(self, *, upright: bool = False) -> list[Tick]:
        """As many round ticks as stand apart, at least two; `upright`: a vertical axis."""
        length = abs(self.end - self.start)
        if self.log:
            decades = _log_ticks(self.low, self.high, length / (26.0 if upright else 44.0))
            if sum(tick.label != "" for tick in decades) > 1:
                return decades
        chosen: list[Tick] = []
        for step in _steps(self.high - self.low):
            ticks = _linear_ticks(self.low, self.high, step)
            if upright:
                room = 22.0 if length < 130.0 else 32.0
            else:
                widest = max((text_width(tick.label) for tick in ticks), default=0.0)
                room = max(widest + 16.0, min(length / 10.0, 60.0))
            if (
                len(ticks) > 1
                and abs(self.at(ticks[-1].value) - self.at(ticks[-2].value)) < room
                and len(chosen) > 1
            ):
                break
            chosen = ticks
        return chosen


def _steps(span: float) -> Iterator[float]:
    """Round steps from as large as the span down to its fiftieth."""
    decade = math.floor(math.log10(span))
    for power in (decade, decade - 1, decade - 2):
        for multiple in (5, 2, 1):
            step = multiple * 10.0**power
            if span / 50 <= step <= span:
                yield step


def _linear_ticks(low: float, high: float, step: float) -> list[Tick]:
    """The multiples of a step within [low, high]."""
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    plain = max(abs(first), abs(last)) * step < 1e6 and decimals <= 4
    values = [index * step for index in range(first, last + 1)]
    return [Tick(v, signed(f"{v:.{decimals}f}" if plain else power_text(v))) for v in values]


def _log_ticks(low: float, high: float, most: float) -> list[Tick]:
    """Decades, labelled as they fit; 2 and 5 too where there is room; fine lines at the other multiples."""
    first, last = math.floor(math.log10(low) + 1e-9), math.floor(math.log10(high) + 1e-9)
    decades = math.log10(high) - math.log10(low)
    every = max(1, math.ceil(decades / max(1.0, most)))
    multiples = (1, 2, 5) if 3 * decades <= most else (1,)
    ticks = []
    for decade in range(first, last + 1):
        for multiple in range(1, 10):
            value = multiple * 10.0**decade
            if not low * (1 - 1e-9) <= value <= high * (1 + 1e-9):
                continue
            if multiple in multiples and decade % every == 0:
                plain = -4 <= decade <= 4
                label = f"{multiple * 10**decade:g}" if plain else power_text(value)
                ticks.append(Tick(value, label))
            elif decades <= 5:
                ticks.append(Tick(value, ""))
    return ticks


def power_text(value: float) -> str:
    """A large or small number with a power of ten: 2·10⁶."""
    if value == 0:
        return "0"
    mantissa, _, exponent = f"{value:.6e}".partition("e")
    mantissa = f"{float(mantissa):g}"
    power = f"10{str(int(exponent)).translate(_SUPERSCRIPT)}"
    return power if mantissa == "1" else f"{mantissa}·{power}"


def signed(text: str) -> str:
    """The same number with a true minus sign, for figures (tables keep the hyphen, which can be pasted)."""
    return text.replace("-", "−") if float_is_nonzero(text) else text.removeprefix("-")


def float_is_nonzero(text: str) -> bool:
    """Whether a written number has any figure but 0."""
    return any(figure in "123456789" for figure in text)


def limits(
    arrays: Iterable[Floats], *, log: bool = False, pad: float = 0.04, include: Iterable[float] = ()
) -> tuple[float, float]:
    """The range that shows all finite values (on a log axis all positive ones) with a little room around."""
    found = [np.asarray(list(include), dtype=np.float64), *arrays]
    values = np.concatenate([a[np.isfinite(a) & (a > _TINIEST if log else True)] for a in found])
    if values.size == 0:
        return (1.0, 10.0) if log else (0.0, 1.0)
    low, high = float(values.min()), float(values.max())
    if log:
        if high / low < 1.0 + 1e-9:
            return low / 2, high * 2
        room = (high / low) ** pad
        return low / room, high * room
    if high - low <= max(1e-12 * max(abs(low), abs(high)), _TINIEST):
        room = abs(low) * 0.1 or 1.0
        return low - room, high + room
    room = (high - low) * pad
    return low - room, high + room
