"""How one plot panel is drawn into a box: grid, curves, bands, marks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrctl.report import decimate
from mrctl.report.axes import Scale, limits
from mrctl.report.decimate import Floats
from mrctl.report.series import Mark, Panel, Series, floats
from mrctl.report.svg import element, number, shorten, text, text_width
from mrctl.report.theme import SERIES_COLOURS

TOP = 21.0
"""Px above the plotting area, for the y label."""
_DOTS_MOST = 1500


def colour_classes(panels: Sequence[Panel]) -> dict[str, str]:
    """The style classes of each label: colours in order of appearance; beyond the palette, dashed."""
    classes: dict[str, str] = {}
    automatic = 0
    for series in (s for panel in panels for s in panel.series):
        if series.label in classes:
            continue
        if isinstance(series.colour, str):
            classes[series.label] = series.colour
            continue
        index = automatic if series.colour is None else series.colour
        automatic += series.colour is None
        classes[series.label] = f"s{index % SERIES_COLOURS}" + (" dash" if index >= SERIES_COLOURS else "")
    for series in (s for panel in panels for s in panel.series if s.dashed):
        if "dash" not in classes[series.label]:
            classes[series.label] += " dash"
    return classes


def x_range(panels: Sequence[Panel], *, log: bool) -> tuple[float, float]:
    """The common x limits of panels: time series fill the width, so no room is added to lines."""
    series = [s for panel in panels for s in panel.series]
    loose = any(s.style == "dots" for s in series) or any(_turns_back(floats(s.x)) for s in series)
    return limits([floats(s.x) for s in series], log=log, pad=0.03 if loose else 0.0)


def _turns_back(x: Floats) -> bool:
    return bool(np.any(np.diff(x[np.isfinite(x)]) < 0))


def y_range(panel: Panel) -> tuple[float, float]:
    """The y limits of a panel: given, or around all that it shows."""
    if panel.y_limits is not None:
        return panel.y_limits
    arrays = [floats(v) for s in panel.series for v in (s.y, s.low, s.high) if v is not None]
    include = [v for m in panel.marks if m.axis == "y" for v in (m.at, m.until) if v is not None]
    filled = any(s.style == "filled" for s in panel.series)
    low, high = limits(arrays, log=panel.y_log, pad=0.06, include=include + ([0.0] if filled else []))
    if filled:
        low = max(low, 0.0) if not panel.y_log else low
    return low, high


def y_scale(panel: Panel, bottom: float, top: float) -> Scale:
    """The panel's y axis between two heights in px."""
    low, high = y_range(panel)
    return Scale(low, high, bottom, top, panel.y_log)


def label_room(scale: Scale) -> float:
    """Px that the tick labels left of an axis need."""
    return max((text_width(t.label) for t in scale.ticks(upright=True)), default=0.0) + 8


def draw_panel(
    panel: Panel,
    x: Scale,
    y: Scale,
    classes: dict[str, str],
    *,
    x_labels: bool = True,
    y_labels: bool = True,
    budget: int | None = None,
) -> list[str]:
    """The panel as SVG between the px of its scales; `budget` bounds the bins that its series share."""
    left, right, bottom, top = x.start, x.end, y.start, y.end
    width, height = right - left, bottom - top
    out = _grid(x, y, x_labels=x_labels, y_labels=y_labels)
    heading = panel.title or panel.y_label
    out.append(text(left if panel.title else 0, top - 8, heading, "sub" if panel.title else ""))
    out += [_shade(m, x, y) for m in panel.marks if m.until is not None]
    inside = []
    if panel.zero:
        inside += [_h(y.at(0.0), left, right, "zero")] if y.low < 0 < y.high else []
        inside += [_v(x.at(0.0), top, bottom, "zero")] if x.low < 0 < x.high else []
    bins = max(50, min(int(width / 2), (budget or 10**9) // max(1, len(panel.series))))
    for series in panel.series:
        inside += _curve(series, x, y, classes[series.label], bins)
    # A nested svg clips what lies outside the limits, without an id.
    clip = {"x": left - 1, "y": top - 1, "width": width + 2, "height": height + 2}
    shifted = element("g", inside, transform=f"translate({number(1 - left)} {number(1 - top)})")
    out.append(element("svg", shifted, **clip))
    out += _mark_lines(panel.marks, x, y)
    return out


def _h(y: float, left: float, right: float, class_: str) -> str:
    return element("path", class_=class_, d=f"M{number(left)} {number(y)}H{number(right)}")


def _v(x: float, top: float, bottom: float, class_: str) -> str:
    return element("path", class_=class_, d=f"M{number(x)} {number(top)}V{number(bottom)}")


def _grid(x: Scale, y: Scale, *, x_labels: bool, y_labels: bool) -> list[str]:
    left, right, bottom, top = x.start, x.end, y.start, y.end
    paths = {"grid": "", "fine": ""}
    out = []
    for tick in y.ticks(upright=True):
        place = y.at(tick.value)
        paths["grid" if tick.label else "fine"] += f"M{number(left)} {number(place)}H{number(right)}"
        if y_labels and tick.label:
            out.append(text(left - 6, place + 3.8, tick.label, "tick end"))
    for tick in x.ticks():
        place = x.at(tick.value)
        paths["grid" if tick.label else "fine"] += f"M{number(place)} {number(top)}V{number(bottom)}"
        if x_labels and tick.label:
            out.append(text(place, bottom + 15, tick.label, "tick mid"))
    lines = [element("path", class_=name, d=d) for name, d in paths.items() if d]
    return [*lines, _h(bottom, left, right, "frame"), *out]


def _curve(series: Series, x: Scale, y: Scale, class_: str, bins: int) -> list[str]:
    data_x, data_y = floats(series.x), floats(series.y)
    if data_x.shape != data_y.shape or data_x.ndim != 1:
        raise ValueError(f"series {series.label!r}: x has shape {data_x.shape}, y {data_y.shape}")
    px, py = x(data_x), y(data_y)
    colour = class_.partition(" ")[0]
    out = []
    if series.low is not None and series.high is not None:
        out += _band(px, y(floats(series.low)), y(floats(series.high)), colour, bins)
    if series.style == "dots":
        good = np.isfinite(px) & np.isfinite(py)
        px, py = decimate.thin_cloud(px[good], py[good], _DOTS_MOST)
        d = "".join(f"M{number(a)} {number(b)}h0" for a, b in zip(px, py, strict=True))
        return [*out, element("path", class_=f"dots {colour}", d=d)] if d else out
    if series.style == "filled":
        py = np.where(data_y == 0, y.start, py)  # an empty bin of a histogram lies on a log axis' floor
    d = ""
    for piece in decimate.pieces(px, py):
        line = px[piece], py[piece]
        if series.style in {"step", "filled"}:
            line = np.repeat(line[0], 2)[1:], np.repeat(line[1], 2)[:-1]
            line = _corners(*line)
        line = decimate.straighten(*decimate.extremes(*line, bins), 0.2)
        d += decimate.path(*line)
        if series.style == "filled":
            floor = np.concatenate(([y.start], line[1], [y.start]))
            area = decimate.path(np.pad(line[0], 1, mode="edge"), floor, closed=True)
            out.append(element("path", class_=f"band {colour}", d=area))
    return [*out, element("path", class_=f"line {class_}", d=d)] if d else out


def _corners(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """A step line without the points between two corners, so that thinning leaves its edges upright."""
    if len(x) < 3:
        return x, y
    level = np.diff(y) == 0
    inner = np.concatenate(([False], level[1:] & level[:-1], [False]))
    return x[~inner], y[~inner]


def _band(px: Floats, low: Floats, high: Floats, colour: str, bins: int) -> list[str]:
    d = ""
    for piece in decimate.pieces(px, low, high):
        edges = [
            decimate.straighten(*decimate.extremes(px[piece], edge[piece], bins), 0.2) for edge in (high, low)
        ]
        around = (np.concatenate((over, under[::-1])) for over, under in zip(*edges, strict=True))
        d += decimate.path(*around, closed=True)
    return [element("path", class_=f"band {colour}", d=d)] if d else []


def _shade(mark: Mark, x: Scale, y: Scale) -> str:
    if mark.until is None:
        return ""
    scale = x if mark.axis == "x" else y
    ends = sorted(scale.at(min(max(v, scale.low), scale.high)) for v in (mark.at, mark.until))
    size = max(ends[1] - ends[0], 1.0)
    if mark.axis == "x":
        box = {"x": ends[0], "y": y.end, "width": size, "height": y.start - y.end}
    else:
        box = {"x": x.start, "y": ends[0], "width": x.end - x.start, "height": size}
    return element("rect", class_=f"band {mark.tone}", **box)


def _mark_lines(marks: Sequence[Mark], x: Scale, y: Scale) -> list[str]:
    out = []
    last_right, row = -1e9, 0
    for mark in sorted(marks, key=lambda m: (m.axis, m.at)):
        scale = x if mark.axis == "x" else y
        end = mark.until if mark.until is not None else mark.at
        if end < scale.low or mark.at > scale.high:
            continue
        place = scale.at(max(mark.at, scale.low))
        if mark.axis == "y":
            out += [_h(place, x.start, x.end, f"mark {mark.tone}")] if mark.until is None else []
            out.append(text(x.end - 4, place - 4, mark.label, "halo end"))
            continue
        out += [_v(place, y.end, y.start, f"mark {mark.tone}")] if mark.until is None else []
        label = shorten(mark.label, (x.end - x.start) / 2)
        wide = text_width(label)
        # Labels that would touch go down a row; near the right edge they stand left of the line.
        left = place + 4 if place + 4 + wide <= x.end else place - 4 - wide
        row = (row + 1) % 4 if left < last_right + 6 else 0
        last_right = max(last_right, left + wide)
        out.append(text(left, y.end + 12 + 13 * row, label, "halo"))
    return [line for line in out if line]
