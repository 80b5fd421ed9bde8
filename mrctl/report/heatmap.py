"""Heat maps: a value over two binned variables, with a colour bar; what is not known is hatched."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from mrctl.report.axes import Scale, signed
from mrctl.report.decimate import Floats
from mrctl.report.quantity import format_number
from mrctl.report.series import Numbers, floats
from mrctl.report.svg import Figure, element, figure, number, shorten, text, text_width
from mrctl.report.theme import RAMP_LEVELS

_SLANT = math.radians(50)


def heat_map(
    title: str,
    x_label: str,
    y_label: str,
    x: Sequence[str] | Numbers,
    y: Sequence[str] | Numbers,
    values: Sequence[Sequence[float | None]] | Floats,
    value_label: str,
    *,
    diverging: bool = False,
    limits: tuple[float, float] | None = None,
    digits: int = 2,
    half: bool = False,
    description: str = "",
) -> Figure:
    """Cells coloured by value, rows by y, columns by x; None and NaN are hatched.

    `values` has shape (rows, columns). x and y are texts (one per cell; rows then run downward, as in a
    table) or numbers: one per cell for centres, one more for the edges of bins (rows then run upward).
    Cells are equally large. With `diverging` the colours are symmetric about zero, for signed errors.
    """
    grid = np.array([[np.nan if v is None else v for v in row] for row in values], dtype=np.float64)
    if grid.ndim != 2 or not _fits(x, grid.shape[1]) or not _fits(y, grid.shape[0]):
        raise ValueError(f"heat map {title!r}: values of shape {grid.shape} for {len(x)} x and {len(y)} y")
    rows, columns = grid.shape
    low, high = limits or _range(grid, diverging=diverging)
    letter = "v" if diverging else "q"
    shares = np.nan_to_num((grid - low) / (high - low), posinf=1.0, neginf=0.0)
    levels = np.clip(shares * (RAMP_LEVELS - 1), 0, RAMP_LEVELS - 1).round().astype(int)
    upward = not _texts(y)
    x_names, y_names = _names(x), _names(y)

    def draw(width: float) -> tuple[list[str], float]:
        left = min(max((text_width(n) for n in y_names), default=0.0) + 8, 0.36 * width)
        right = max(8.0, text_width(x_names[-1]) / 2) if len(x_names) > columns else 8.0
        cell = (width - left - right) / columns
        tall = min(max(min(cell * 0.7, 30.0), 16.0 if rows <= 30 else 300.0 / rows * 1.4), 34.0)
        out, top = _colour_bar(low, high, letter, value_label, width)
        out.append(text(0, top + 11, y_label))
        top += 22
        bottom = top + rows * tall

        def corner(row: int, column: int) -> tuple[float, float]:
            return left + column * cell, (bottom - (row + 1) * tall) if upward else top + row * tall

        labels = [[_cell_text(v, digits) for v in row] for row in grid]
        written = cell >= max(text_width(t) for row in labels for t in row) + 4 and tall >= 14
        gap = 1.0 if written else 0.0
        out += _cells(grid, levels, letter, corner, cell - gap, tall - gap)
        for row, column in np.ndindex(grid.shape) if written else ():
            x, y = corner(row, column)
            style = f"on {letter}{levels[row, column]} mid" if np.isfinite(grid[row, column]) else "mid halo"
            out.append(text(x + (cell - gap) / 2, y + tall / 2 + 3.5, labels[row][column], style))
        out += _y_labels(y_names, rows, left, tall, top, upward=upward)
        below, x_texts = _x_labels(x_names, columns, left, cell, bottom)
        out += x_texts
        out.append(text(left + columns * cell / 2, bottom + below + 14, x_label, "mid"))
        return out, bottom + below + 20

    words = f"{value_label} over {x_label} and {y_label}, {_cell_text(low, 3)} to {_cell_text(high, 3)}. "
    return figure(title, description or words + _extreme(grid, x_names, y_names, digits), draw, half=half)


def _texts(labels: Sequence[str] | Numbers) -> bool:
    return len(labels) > 0 and isinstance(labels[0], str)


def _fits(labels: Sequence[str] | Numbers, cells: int) -> bool:
    return len(labels) == cells or (len(labels) == cells + 1 and not _texts(labels))


def _names(labels: Sequence[str] | Numbers) -> list[str]:
    if _texts(labels):
        return [str(label) for label in labels]
    places = floats(labels)  # type: ignore[arg-type] # numbers, just checked
    apart = np.abs(np.diff(places))
    finest = float(apart.min()) if apart.size and apart.min() > 0 else max(1e-9, float(np.abs(places).max()))
    decimals = min(max(0, 1 - math.floor(math.log10(finest))), 6)
    # Only as many decimals as any of them needs.
    texts = [f"{place:.{decimals}f}" for place in places]
    while decimals > 0 and all(text.endswith("0") for text in texts):
        decimals -= 1
        texts = [text[:-1] for text in texts]
    return [signed(text.removesuffix(".")) for text in texts]


def _range(grid: Floats, *, diverging: bool) -> tuple[float, float]:
    finite = grid[np.isfinite(grid)]
    if finite.size == 0:
        return (-1.0, 1.0) if diverging else (0.0, 1.0)
    low, high = float(finite.min()), float(finite.max())
    if diverging:
        most = max(abs(low), abs(high), 1e-300)
        return -most, most
    return (
        (low, high) if high - low > max(1e-12 * max(abs(low), abs(high)), 1e-300) else (low - 0.5, high + 0.5)
    )


def _cell_text(value: float, digits: int) -> str:
    if math.isfinite(value) and value == round(value) and abs(value) < 1e4:
        return signed(str(round(value)))
    return format_number(value, digits).replace("-", "−")


def _cells(
    grid: Floats,
    levels: np.ndarray[tuple[int, int], np.dtype[np.int64]],
    letter: str,
    corner: Callable[[int, int], tuple[float, float]],
    width: float,
    height: float,
) -> list[str]:
    """One path per colour, and one of slanted strokes for the cells without a value."""
    paths: dict[int, str] = {}
    hatch = ""
    box = f"h{number(width)}v{number(height)}h{number(-width)}z"
    for row, column in np.ndindex(grid.shape):
        x, y = corner(row, column)
        if np.isfinite(grid[row, column]):
            level = int(levels[row, column])
            paths[level] = paths.get(level, "") + f"M{number(x)} {number(y)}{box}"
            continue
        for along in np.arange(3.0, width + height, 6.0):
            right, up = x + min(along, width), y + max(0.0, along - width)
            left, down = x + max(0.0, along - height), y + min(along, height)
            hatch += f"M{number(right)} {number(up)}L{number(left)} {number(down)}"
    cells = [element("path", class_=f"{letter}{level}", d=d) for level, d in sorted(paths.items())]
    out = [element("g", cells, class_="cells")]
    return [*out, element("path", class_="hatch", d=hatch)] if hatch else out


def _colour_bar(low: float, high: float, letter: str, label: str, width: float) -> tuple[list[str], float]:
    """The value's name, the ramp with its ticks beside or below it, and the height of both."""
    name = text_width(label) + 12
    below = name > width - 170
    start = 0.0 if below else name
    y = 16.0 if below else 3.0
    length = min(240.0, width - start - 16)
    step = length / RAMP_LEVELS
    steps = [
        element("rect", class_=f"{letter}{i}", x=start + i * step, y=y, width=step + 0.5, height=10)
        for i in range(RAMP_LEVELS)
    ]
    out = [text(0, 12, label), element("g", steps, class_="cells")]
    scale = Scale(low, high, start, start + length)
    for tick in scale.ticks():
        place = scale.at(tick.value)
        out.append(element("path", class_="frame", d=f"M{number(place)} {number(y + 10)}v3"))
        out.append(text(max(place, text_width(tick.label) / 2), y + 24, tick.label, "tick mid"))
    return out, y + 34


def _x_labels(
    names: Sequence[str], columns: int, left: float, cell: float, bottom: float
) -> tuple[float, list[str]]:
    """The room that labels take, and the labels: at middles or edges, aslant where words would touch."""
    edges = len(names) == columns + 1
    places = [left + (i + (0.0 if edges else 0.5)) * cell for i in range(len(names))]
    widest = max((text_width(n) for n in names), default=0.0)
    numeric = all(n.lstrip("−")[:1].isdigit() for n in names)
    if widest + 8 <= cell or numeric:
        every = max(1, math.ceil((widest + 8) / cell))
        shown = list(zip(places, names, strict=True))[::every]
        return 18.0, [text(place, bottom + 14, name, "tick mid") for place, name in shown]
    out = []
    for place, name in zip(places, names, strict=True):
        x, y = number(place + 3), number(bottom + 10)
        cut = shorten(name, max(60.0, (place - 4) / math.cos(_SLANT)) if place < 100 else 120.0)
        out.append(text(0, 0, cut, "tick end", transform=f"translate({x} {y})rotate(-50)"))
    return 14.0 + min(widest, 120.0) * math.sin(_SLANT), out


def _y_labels(
    names: Sequence[str], rows: int, left: float, tall: float, top: float, *, upward: bool
) -> list[str]:
    edges = len(names) == rows + 1
    every = max(1, math.ceil(13 / tall))
    out = []
    for index in range(0, len(names), every):
        place = (index + (0.0 if edges else 0.5)) * tall
        y = top + (rows * tall - place if upward else place)
        out.append(text(left - 6, y + 3.8, shorten(names[index], left - 6), "tick end"))
    return out


def _extreme(grid: Floats, x_names: Sequence[str], y_names: Sequence[str], digits: int) -> str:
    if not np.isfinite(grid).any():
        return "No data."
    row, column = divmod(int(np.nanargmax(np.abs(grid))), grid.shape[1])
    return f"Largest: {_cell_text(float(grid[row, column]), digits)} at {x_names[column]}, {y_names[row]}."
