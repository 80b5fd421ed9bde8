"""Tables of a report page: cells, alignment by content, the best value of a column marked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from mrctl.report.quantity import format_column
from mrctl.report.svg import escape
from mrctl.report.theme import Tone

Value: TypeAlias = str | float | None


@dataclass(frozen=True, slots=True)
class Cell:
    """A table cell with a tone, or with a text of its own; `value` counts for the best of its column."""

    value: Value
    text: str | None = None
    tone: Tone | None = None


def cell_value(cell: Value | Cell) -> Value:
    """The bare value of a cell."""
    return cell.value if isinstance(cell, Cell) else cell


def cell_texts(rows: Sequence[Sequence[Value | Cell]], digits: int = 3) -> list[list[str]]:
    """What each cell shows: its own text, or its value; the numbers of a column have the same decimals."""
    texts = [[""] * len(row) for row in rows]
    for column in range(len(rows[0]) if rows else 0):
        cells = [row[column] for row in rows]
        values = [cell_value(cell) for cell in cells]
        numbers = iter(format_column([v for v in values if not isinstance(v, str)], digits))
        for i, (cell, value) in enumerate(zip(cells, values, strict=True)):
            shown = value if isinstance(value, str) else next(numbers)
            texts[i][column] = cell.text if isinstance(cell, Cell) and cell.text is not None else shown
    return texts


def alignment(headers: Sequence[str], rows: Sequence[Sequence[Value | Cell]], align: str = "") -> str:
    """A letter l, r or c per column: as given, else r where a column has numbers and no text."""
    for row in rows:
        if len(row) != len(headers):
            raise ValueError(f"a row of {len(row)} cells under {len(headers)} headers: {row!r}")
    letters = list(align.ljust(len(headers)))
    for column, letter in enumerate(letters):
        if letter == " ":
            values = [cell_value(row[column]) for row in rows]
            texts = any(isinstance(v, str) and v for v in values)
            letters[column] = "r" if values and not texts and column > 0 else "l"
    return "".join(letters)


def best_rows(
    rows: Sequence[Sequence[Value | Cell]], best: dict[int, Literal["min", "max"]]
) -> set[tuple[int, int]]:
    """The (row, column) of the best number of each asked column; ties are all best, one alone is not."""
    marked = set()
    for column, which in best.items():
        values = {
            i: float(v)
            for i, v in enumerate(cell_value(row[column]) for row in rows)
            if v is not None and not isinstance(v, str) and math.isfinite(v)
        }
        if len(values) > 1:
            target = min(values.values()) if which == "min" else max(values.values())
            marked |= {(i, column) for i, value in values.items() if value == target}
    return marked


def html_table(
    headers: Sequence[str],
    rows: Sequence[Sequence[Value | Cell]],
    caption: str,
    *,
    align: str,
    best: dict[int, Literal["min", "max"]],
    digits: int,
) -> str:
    """The table as HTML, in a box that scrolls sideways by itself on a narrow screen."""
    classes = [{"r": "r", "c": "c"}.get(letter, "") for letter in alignment(headers, rows, align)]
    marked = best_rows(rows, best)
    head = "".join(_tag("th", escape(h), c, 'scope="col"') for h, c in zip(headers, classes, strict=True))
    texts = cell_texts(rows, digits)
    body = []
    for i, row in enumerate(rows):
        cells = []
        for column, cell in enumerate(row):
            inside = escape(texts[i][column])
            if isinstance(cell, Cell) and cell.tone:
                inside = f'<span class="tone {cell.tone}">{inside}</span>'
            kind = f"{classes[column]} best".strip() if (i, column) in marked else classes[column]
            cells.append(_tag("td", inside, kind) if column else _tag("th", inside, kind, 'scope="row"'))
        body.append(f"<tr>{''.join(cells)}</tr>")
    title = f"<caption><span>{escape(caption)}</span></caption>" if caption else ""
    name = escape(caption or f"Table: {', '.join(headers)}")
    return (
        f'<div class="scroll" role="region" tabindex="0" aria-label="{name}"><table>{title}'
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(body)}</tbody></table></div>"
    )


def _tag(name: str, inside: str, class_: str, more: str = "") -> str:
    attributes = (f' class="{class_}"' if class_ else "") + (f" {more}" if more else "")
    return f"<{name}{attributes}>{inside}</{name}>"
