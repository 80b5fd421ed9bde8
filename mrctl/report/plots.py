"""Figures with x and y axes: lines, stacked panels, force-velocity loops, small multiples, histograms."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from mrctl.report.axes import Scale
from mrctl.report.panel import (
    TOP,
    colour_classes,
    draw_panel,
    label_room,
    x_range,
    y_range,
    y_scale,
)
from mrctl.report.series import Mark, Numbers, Panel, Series, floats
from mrctl.report.svg import Figure, element, figure, number, text, text_width

_BELOW = 36.0
"""Px below the lowest panel: tick labels and the x label."""
_BUDGET = 1400
"""Bins that all series of a figure share, so that it stays within tens of kB."""


def line_plot(
    title: str,
    x_label: str,
    y_label: str,
    series: Sequence[Series],
    *,
    marks: Sequence[Mark] = (),
    x_log: bool = False,
    y_log: bool = False,
    x_limits: tuple[float, float] | None = None,
    y_limits: tuple[float, float] | None = None,
    height: float = 220.0,
    half: bool = False,
    description: str = "",
) -> Figure:
    """Curves over a common x: lines, steps, dots, bands, as each Series asks. Labels: `Force (N)`."""
    panel = Panel(y_label, series, marks, y_log, y_limits, height=height)
    return panels_plot(
        title, x_label, [panel], x_log=x_log, x_limits=x_limits, half=half, description=description
    )


def panels_plot(
    title: str,
    x_label: str,
    panels: Sequence[Panel],
    *,
    x_log: bool = False,
    x_limits: tuple[float, float] | None = None,
    half: bool = False,
    description: str = "",
) -> Figure:
    """Panels one above another that share x, such as force, current and temperature over time."""
    limits_x = x_limits or x_range(panels, log=x_log)
    classes = colour_classes(panels)
    count = sum(len(panel.series) for panel in panels)

    def draw(width: float) -> tuple[list[str], float]:
        out, y = legend(panels, classes, width)
        probes = [y_scale(panel, panel.height, 0.0) for panel in panels]
        left = max(label_room(probe) for probe in probes)
        right_room = 10.0
        for index, panel in enumerate(panels):
            top = y + TOP
            bottom = top + panel.height
            x = Scale(*limits_x, left, width - right_room, x_log)
            share = _BUDGET * len(panel.series) // max(1, count)
            last = index == len(panels) - 1
            out += draw_panel(panel, x, y_scale(panel, bottom, top), classes, x_labels=last, budget=share)
            y = bottom + (0 if last else 8)
        out.append(text((left + width - right_room) / 2, y + 31, x_label, "mid"))
        return out, y + _BELOW

    return figure(title, description or _describe(x_label, panels), draw, half=half)


def loop_plot(
    title: str,
    x_label: str,
    y_label: str,
    series: Sequence[Series],
    *,
    half: bool = True,
    height: float = 300.0,
    description: str = "",
) -> Figure:
    """Closed curves about zero, such as force over velocity or over stroke, with both zero lines."""
    panel = Panel(y_label, series, height=height, zero=True)
    return panels_plot(title, x_label, [panel], half=half, description=description)


def small_multiples(
    title: str,
    x_label: str,
    panels: Sequence[Panel],
    *,
    columns: int = 3,
    x_log: bool = False,
    height: float = 120.0,
    description: str = "",
) -> Figure:
    """Many small panels with the same axes, one per run or condition; each panel's title says which.

    The y label is that of the first panel. On a phone they stand in two columns.
    """
    limits_x = x_range(panels, log=x_log)
    ranges = [y_range(panel) for panel in panels]
    limits_y = (min(low for low, _ in ranges), max(high for _, high in ranges)) if ranges else (0.0, 1.0)
    panels = [dataclasses.replace(panel, y_limits=limits_y, height=height) for panel in panels]
    classes = colour_classes(panels)
    budget = max(50, 2 * _BUDGET // max(1, len(panels)))

    def draw(width: float) -> tuple[list[str], float]:
        out, y = legend(panels, classes, width)
        if panels:
            out.append(text(0, y + 11, panels[0].y_label))
        y += 14
        across = min(columns, 2 if width < 500 else columns, max(1, len(panels)))
        left = label_room(Scale(*limits_y, height, 0.0, bool(panels and panels[0].y_log)))
        gap = 22.0
        each = (width - left - 8 - gap * (across - 1)) / across
        rows = -(-len(panels) // across)
        for index, panel in enumerate(panels):
            row, column = divmod(index, across)
            x_start = left + column * (each + gap)
            top = y + TOP + row * (height + TOP + 4)
            lowest = index + across >= len(panels)
            out += draw_panel(
                panel,
                Scale(*limits_x, x_start, x_start + each, x_log),
                y_scale(panel, top + height, top),
                classes,
                x_labels=lowest,
                y_labels=column == 0,
                budget=budget,
            )
        bottom = y + rows * (height + TOP + 4)
        out.append(text((left + width) / 2, bottom + 29, x_label, "mid"))
        return out, bottom + _BELOW

    return figure(title, description or _describe(x_label, panels[:1]) + f" {len(panels)} panels.", draw)


def histogram(
    title: str,
    x_label: str,
    samples: Sequence[tuple[str, Numbers]],
    *,
    y_label: str = "Count",
    bins: int | None = None,
    marks: Sequence[Mark] = (),
    y_log: bool = False,
    height: float = 180.0,
    half: bool = False,
    description: str = "",
) -> Figure:
    """How often values occur, one outline per sample over common bins; not finite values are left out."""
    finite = [
        (label, values[np.isfinite(values)]) for label, values in ((s[0], floats(s[1])) for s in samples)
    ]
    pooled = np.concatenate([np.empty(0), *(values for _, values in finite)])
    if pooled.size and bins is None:
        bins = min(80, max(10, round(2 * pooled.size ** (1 / 3))))  # Rice's rule, within what can be seen
    edges = np.histogram_bin_edges(pooled, bins or 10) if pooled.size else np.array([0.0, 1.0])
    series = []
    for label, values in finite:
        counts = np.histogram(values, edges)[0].astype(np.float64)
        series.append(Series(label, edges, np.append(counts, counts[-1]), "filled"))
    y_limits = (0.5, 1.5 * max((float(np.max(floats(s.y))) for s in series), default=1.0)) if y_log else None
    return line_plot(
        title,
        x_label,
        y_label,
        series,
        marks=marks,
        y_log=y_log,
        y_limits=y_limits,
        height=height,
        half=half,
        description=description,
    )


def legend(panels: Sequence[Panel], classes: dict[str, str], width: float) -> tuple[list[str], float]:
    """Swatches and labels in rows, and their height; a panel's only series is named by its axis."""
    shown: dict[str, Series] = {}
    for series in (s for panel in panels if len(panel.series) > 1 for s in panel.series):
        if series.label:
            shown.setdefault(series.label, series)
    if not shown:
        return [], 0.0
    out = []
    x, y = 0.0, 0.0
    for label, series in shown.items():
        need = 22 + text_width(label) + 14
        if x > 0 and x + need - 14 > width:
            x, y = 0.0, y + 16
        out.append(_swatch(series, classes[label], x, y + 9))
        out.append(text(x + 22, y + 13, label))
        x += need
    return out, y + 20


def _swatch(series: Series, class_: str, x: float, y: float) -> str:
    colour = class_.partition(" ")[0]
    if series.style == "dots":
        return element("path", class_=f"dots {colour}", d=f"M{number(x + 3)} {number(y)}h0m6 0h0m6 0h0")
    box = element("rect", class_=f"band {colour}", x=x, y=y - 5, width=16, height=10)
    line = element("path", class_=f"line {class_}", d=f"M{number(x)} {number(y)}h16")
    return (box if series.low is not None or series.style == "filled" else "") + line


def _describe(x_label: str, panels: Sequence[Panel]) -> str:
    """What the figure shows in words, with each series' range, for those who cannot see it."""
    sentences = []
    for panel in panels:
        names = []
        for series in panel.series:
            y = floats(series.y)
            y = y[np.isfinite(y)]
            names.append(
                f"{series.label} from {y.min():.4g} to {y.max():.4g}"
                if y.size
                else f"{series.label}: no data"
            )
        sentences.append(f"{panel.y_label} over {x_label}: {'; '.join(names)}.")
    return " ".join(sentences)
