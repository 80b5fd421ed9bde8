"""Horizontal bars: grouped values with whiskers, and the waterfall of an error falling to its floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mrctl.report.axes import Scale, limits
from mrctl.report.decimate import Floats
from mrctl.report.quantity import MISSING, format_column, format_number, format_quantity
from mrctl.report.series import Numbers, floats
from mrctl.report.svg import Figure, element, figure, number, shorten, text, text_width
from mrctl.report.theme import SERIES_COLOURS

_BELOW = 36.0


@dataclass(frozen=True, slots=True)
class Bars:
    """One value per category; `low` and `high` add whiskers. A value that is not finite leaves a dash."""

    label: str
    values: Numbers
    low: Numbers | None = None
    high: Numbers | None = None


@dataclass(frozen=True, slots=True)
class Reference:
    """A vertical line at a value that bars are held against: a floor, a limit, a published figure."""

    value: float
    label: str


def bar_plot(
    title: str,
    value_label: str,
    categories: Sequence[str],
    bars: Sequence[Bars],
    *,
    log: bool = False,
    references: Sequence[Reference] = (),
    digits: int = 3,
    half: bool = False,
    description: str = "",
) -> Figure:
    """Bars from left to right, grouped by category, each with its value written at its end."""
    for group in bars:
        if len(group.values) != len(categories):
            raise ValueError(
                f"bars {group.label!r}: {len(group.values)} values for {len(categories)} categories"
            )
    arrays = [floats(v) for g in bars for v in (g.values, g.low, g.high) if v is not None]
    marks = [r.value for r in references]
    low, high = limits(arrays, log=log, pad=0.0, include=marks if log else [0.0, *marks])
    low, high = (low / 1.6, high * 1.1) if log else _room(low, high, arrays)
    written = iter(format_column([float(v) for g in bars for v in floats(g.values)], digits))
    texts = [[next(written).replace("-", "−") for _ in categories] for _ in bars]
    one = len(bars) == 1
    thick = 13.0 if one else 11.0
    pitch = len(bars) * (thick + 1) + (7 if one else 10)

    def draw(width: float) -> tuple[list[str], float]:
        out, y = _legend([g.label for g in bars], width) if not one else ([], 0.0)
        y += 15.0 * (1 + _rows(references, width)) if references else 4.0
        left = min(max((text_width(c) for c in categories), default=0.0) + 10, 0.42 * width)
        room = max((text_width(t) for group in texts for t in group), default=0.0)
        x = Scale(low, high, left, width - room - 12, log)
        bottom = y + pitch * len(categories)
        out += _axis(x, y, bottom, value_label, width)
        for row, category in enumerate(categories):
            top = y + row * pitch + (pitch - len(bars) * (thick + 1)) / 2
            middle = y + (row + 0.5) * pitch + 4
            out.append(text(left - 7, middle, shorten(category, left - 8), "end"))
            for index, group in enumerate(bars):
                at = top + index * (thick + 1)
                out += _bar(group, row, x, at, thick, f"s{index % SERIES_COLOURS}", texts[index][row])
        out += _references(references, x, y, bottom, width)
        return out, bottom + _BELOW

    return figure(title, description or _describe(value_label, categories, bars, digits), draw, half=half)


def waterfall(
    title: str,
    value_label: str,
    steps: Sequence[tuple[str, float]],
    *,
    floor: Reference | None = None,
    unit: str = "",
    digits: int = 3,
    half: bool = False,
    description: str = "",
) -> Figure:
    """A value falling (or rising) step by step to a floor line, such as the error with each effect added.

    `steps` are (label, value after that step); the first is where it starts.
    """
    values = floats([value for _, value in steps])
    low, high = _room(*limits([values], pad=0.0, include=[0.0, *([floor.value] if floor else [])]), [values])
    references = [floor] if floor else []
    pitch, thick = 22.0, 13.0
    written = format_column([float(v) for v in values], digits)
    changes = [written[i] + _change(values, i) for i in range(len(steps))]

    def draw(width: float) -> tuple[list[str], float]:
        y = 16.0 if floor else 4.0
        left = min(max((text_width(label) for label, _ in steps), default=0.0) + 10, 0.42 * width)
        room = max((text_width(change) for change in changes), default=0.0)
        x = Scale(low, high, left, width - room - 12)
        bottom = y + pitch * len(steps)
        out = _axis(x, y, bottom, value_label, width)
        for row, (label, _) in enumerate(steps):
            top = y + row * pitch + (pitch - thick) / 2
            out.append(text(left - 7, top + 10, shorten(label, left - 8), "end"))
            value = float(values[row])
            if not math.isfinite(value):
                out.append(text(x.start + 5, top + 10, MISSING, "tick"))
                continue
            before = float(values[row - 1]) if row and math.isfinite(values[row - 1]) else value
            kept, moved = sorted((x.at(value), x.at(before)))
            out.append(_rect(x.start, top, kept - x.start, thick, "bar s0"))
            if row:  # what is gone is pale beside what is left
                out.append(
                    _rect(kept, top, moved - kept, thick, "rest good" if value <= before else "bar bad")
                )
                edge = x.at(before)
                out.append(element("path", class_="frame", d=f"M{number(edge)} {number(top - 9)}v9"))
            out.append(text(max(kept, moved) + 5, top + 10, changes[row], "halo"))
        out += _references(references, x, y, bottom, width)
        return out, bottom + _BELOW

    words = ", ".join(f"{label} {format_quantity(value, unit, digits)}" for label, value in steps)
    words = f"{value_label}: {words}." + (f" {floor.label}." if floor else "")
    return figure(title, description or words, draw, half=half)


def _room(low: float, high: float, arrays: Sequence[Floats]) -> tuple[float, float]:
    """A little room beyond the bars; bars that never go below zero start at the edge."""
    below = any((a < 0).any() for a in arrays)
    return (low - 0.02 * (high - low) if below else 0.0), high + 0.02 * (high - low)


def _change(values: Floats, row: int) -> str:
    """By how much a step changed the value before it, in percent."""
    before, after = (float(values[row - 1]), float(values[row])) if row else (0.0, 0.0)
    percent = 100.0 * (after / before - 1.0) if before > 0 else math.nan
    return f" ({percent:+.0f} %)".replace("-", "−") if math.isfinite(percent) else ""


def _rect(x: float, y: float, width: float, height: float, class_: str) -> str:
    return element("rect", class_=class_, x=x, y=y, width=max(width, 0.0), height=height)


def _bar(group: Bars, row: int, x: Scale, top: float, thick: float, colour: str, written: str) -> list[str]:
    value = float(floats(group.values)[row])
    base = x.start if x.log else x.at(min(max(0.0, x.low), x.high))
    middle = top + thick / 2
    end = x.at(value)
    if not math.isfinite(end):  # no value, or none that a log axis can show
        return [text(base + 5, middle + 3.8, written, "tick")]
    out = [_rect(min(base, end), top, abs(end - base), thick, f"bar {colour}")]
    tip = max(end, base)
    if group.low is not None and group.high is not None:
        ends = [x.at(float(v)) for v in (floats(group.low)[row], floats(group.high)[row])]
        if all(math.isfinite(e) for e in ends):
            a, b = (number(e) for e in ends)
            up, down = number(middle - 3), number(middle + 3)
            d = f"M{a} {number(middle)}H{b}M{a} {up}V{down}M{b} {up}V{down}"
            out.append(element("path", class_="whisker", d=d))
            tip = max(tip, *ends)
    out.append(text(tip + 5, middle + 3.8, written, "halo"))
    return out


def _axis(x: Scale, top: float, bottom: float, label: str, width: float) -> list[str]:
    out, d = [], ""
    for tick in x.ticks():
        place = x.at(tick.value)
        if tick.label:
            d += f"M{number(place)} {number(top)}V{number(bottom)}"
            out.append(text(place, bottom + 15, tick.label, "tick mid"))
    base = number(x.start if x.log else x.at(min(max(0.0, x.low), x.high)))
    axis = element("path", class_="frame", d=f"M{base} {number(top)}V{number(bottom)}")
    place = min((x.start + x.end) / 2, width - text_width(label) / 2)
    return [element("path", class_="grid", d=d), axis, *out, text(place, bottom + 31, label, "mid")]


def _rows(references: Sequence[Reference], width: float) -> int:
    """Rows of labels beyond the first: one each, unless all fit side by side."""
    return 0 if sum(text_width(r.label) + 20 for r in references) < width / 2 else max(0, len(references) - 1)


def _references(
    references: Sequence[Reference], x: Scale, top: float, bottom: float, width: float
) -> list[str]:
    out = []
    stacked = _rows(references, width) > 0
    for row, reference in enumerate(references):
        place = x.at(reference.value)
        if not math.isfinite(place):
            continue
        up = 15.0 * row if stacked else 0.0
        d = f"M{number(place)} {number(top - up - 2)}V{number(bottom)}"
        out.append(element("path", class_="mark ink", d=d))
        half = text_width(reference.label) / 2
        middle = min(max(place, half), width - half)
        out.append(text(middle, top - up - 5, reference.label, "halo mid"))
    return out


def _legend(labels: Sequence[str], width: float) -> tuple[list[str], float]:
    out = []
    x, y = 0.0, 0.0
    for index, label in enumerate(labels):
        need = 16 + text_width(label) + 14
        if x > 0 and x + need - 14 > width:
            x, y = 0.0, y + 16
        out.append(_rect(x, y + 4, 10, 10, f"bar s{index % SERIES_COLOURS}"))
        out.append(text(x + 15, y + 13, label))
        x += need
    return out, y + 20


def _describe(value_label: str, categories: Sequence[str], bars: Sequence[Bars], digits: int) -> str:
    groups = []
    for group in bars:
        pairs = zip(categories, floats(group.values), strict=True)
        groups.append(
            f"{group.label}: " + ", ".join(f"{c} {format_number(float(v), digits)}" for c, v in pairs)
        )
    return f"{value_label}. " + "; ".join(groups) + "."
