"""What commands print: aligned tables that fit the terminal, colours only where they are wanted."""

from __future__ import annotations

import os
import re
import shutil
import sys
import unicodedata
from collections.abc import Sequence
from typing import Literal, TextIO

from mrctl.report.progress import Progress
from mrctl.report.tables import Cell, Value, alignment, best_rows, cell_texts

__all__ = ["Progress", "colours_wanted", "display_width", "paint", "table"]

_ANSI = re.compile(r"\x1b\[[0-9;]*m")
_CODES = {"bold": "1", "soft": "2", "ink": "0", "good": "32", "warn": "33", "bad": "31"}
_PLAIN = str.maketrans({"─": "-", "–": "-", "−": "-", "…": "..", "µ": "u", "°": "deg ", "²": "2", "·": "*"})
_GAP = 2
_NARROWEST = 8


def colours_wanted(stream: TextIO) -> bool:
    """Whether to colour what goes to `stream`: a terminal that is not dumb, and no NO_COLOR (https://no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def paint(text: str, style: str, stream: TextIO | None = None) -> str:
    """`text` in bold, soft, good, warn or bad where `stream` (standard output) takes colours."""
    if not text or not colours_wanted(stream or sys.stdout):
        return text
    return f"\x1b[{_CODES[style]}m{text}\x1b[0m"


def display_width(text: str) -> int:
    """Columns that a text takes on a terminal: wide letters two, combining marks and colour codes none."""
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1
        for c in _ANSI.sub("", text)
    )


def table(
    headers: Sequence[str],
    rows: Sequence[Sequence[Value | Cell]],
    *,
    title: str = "",
    align: str = "",
    best: dict[int, Literal["min", "max"]] | None = None,
    digits: int = 3,
    width: int | None = None,
    stream: TextIO | None = None,
) -> str:
    """An aligned table without a trailing newline, for standard output (or `stream`).

    Arguments as for Page.table. Where it is wider than the terminal (or `width`), text columns wrap, the
    widest first; numbers never do. Off a terminal nothing is wrapped unless `width` is given.
    """
    stream = stream or sys.stdout
    letters = alignment(headers, rows, align)
    marked = best_rows(rows, best or {})
    texts = [[_clean(text, stream) for text in row] for row in cell_texts(rows, digits)]
    headers = [_clean(header, stream) for header in headers]
    widths = [max(map(display_width, column)) for column in zip(headers, *texts, strict=True)]
    if width is None and stream.isatty():
        width = shutil.get_terminal_size().columns
    if width is not None:
        _squeeze(widths, letters, width)
    rule = _clean("─", stream) * (sum(widths) + _GAP * (len(widths) - 1))
    out = [paint(_clean(title, stream), "bold", stream)] if title else []
    out += _lines(headers, widths, letters, ["bold"] * len(headers), stream)
    out.append(paint(rule, "soft", stream))
    for i, row in enumerate(rows):
        styles = [
            "good" if (i, c) in marked else (cell.tone or "") if isinstance(cell, Cell) else ""
            for c, cell in enumerate(row)
        ]
        out += _lines(texts[i], widths, letters, styles, stream)
    return "\n".join(out)


def _clean(text: str, stream: TextIO) -> str:
    """What `stream` can show, without control characters: a file name must not steer the terminal."""
    text = "".join(c if c.isprintable() else "?" for c in text)
    encoding = stream.encoding or "utf-8"
    if encoding.lower().replace("-", "") == "utf8":
        return text
    return text.translate(_PLAIN).encode(encoding, "replace").decode(encoding)


def _squeeze(widths: list[int], letters: str, width: int) -> None:
    """Narrows the widest text column by one place after the other until the table fits or cannot."""
    while sum(widths) + _GAP * (len(widths) - 1) > width:
        soft = [c for c, letter in enumerate(letters) if letter == "l" and widths[c] > _NARROWEST]
        if not soft:
            return
        widths[max(soft, key=lambda c: widths[c])] -= 1


def _lines(
    cells: Sequence[str], widths: Sequence[int], letters: str, styles: Sequence[str], stream: TextIO
) -> list[str]:
    """One table row, as many lines as its tallest cell."""
    wrapped = [_wrap(cell, width) for cell, width in zip(cells, widths, strict=True)]
    out = []
    for line in range(max(map(len, wrapped))):
        parts = []
        for column, width in enumerate(widths):
            words = wrapped[column][line] if line < len(wrapped[column]) else ""
            room = " " * (width - display_width(words))
            shown = paint(words, styles[column], stream) if styles[column] else words
            left = {"l": "", "r": room, "c": room[: len(room) // 2]}[letters[column]]
            parts.append(left + shown + room[len(left) :])
        out.append((" " * _GAP).join(parts).rstrip())
    return out


def _wrap(text: str, width: int) -> list[str]:
    """Lines of at most `width` columns, cut at spaces, else after `/`, `_`, `-` or `.`, else anywhere."""
    if display_width(text) <= width:
        return [text]
    lines: list[str] = []
    rest = text
    while display_width(rest) > width:
        cut = 0
        while display_width(rest[: cut + 1]) <= width:
            cut += 1
        space = rest.rfind(" ", 0, cut + 1)
        mark = max(rest.rfind(c, 0, cut) for c in "/_-.")
        at = space if space > 0 else mark + 1 if mark > 0 else max(cut, 1)
        lines.append(rest[:at].rstrip())
        rest = rest[at:].lstrip()
    return [*lines, rest] if rest else lines
