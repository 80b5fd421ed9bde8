"""Text tables as measuring systems export them: delimiters, decimal commas, the line of each bad cell.

Clean tables go through numpy's C reader; only a table that it refuses is walked cell by cell, to say what is
wrong in which line. Nothing is guessed in silence: every reading that is not the plain one leaves a note.
"""

from __future__ import annotations

import contextlib
import csv
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mrctl.errors import InputError, Problem
from mrctl.measurements.decode import decode
from mrctl.measurements.run import FloatArray, IntArray

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

WHITESPACE = "whitespace"
DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", WHITESPACE: WHITESPACE}
_DELIMITER_NAMES = {value: name for name, value in DELIMITERS.items()}

_COMMA_NUMBER = re.compile(r"(?<![\d.])[+-]?\d*,\d+(?:[eE][+-]?\d+)?(?![\d.,])")
_QUOTED_COMMA_NUMBER = re.compile(r'"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*"')


@dataclass(frozen=True, slots=True)
class Layout:
    """How a text table is laid out; None means: look. `header` is 0 where there is none."""

    delimiter: str | None = None
    decimal: str | None = None
    header: int | None = None
    skip_lines: int = 0
    comment: str = "#"
    encoding: str | None = None


@dataclass(frozen=True, slots=True)
class Table:
    """The lines of a table that hold data, split into cells only when asked for."""

    path: Path
    names: tuple[str, ...] | None
    header_line: int | None
    rows: list[str]
    lines: IntArray
    delimiter: str
    decimal_comma: bool
    quoted: bool
    notes: list[str] = field(default_factory=list)

    def cells(self, row: str) -> list[str]:
        """The cells of one line."""
        return _cells(row, self.delimiter)

    def numbers(self, wanted: Sequence[int], *, short_rows: bool = False) -> tuple[FloatArray, list[Problem]]:
        """The columns `wanted` (from 0) as an array (rows, len(wanted)), and all that is wrong in them.

        `short_rows`: rows may lack cells after the wanted ones (a column of events often does).
        """
        if not self.quoted:
            try:
                values = self._fast()
            except ValueError:
                pass  # something is not plain: found below, cell by cell, with its line
            else:
                width = len(self.names) if self.names is not None else values.shape[1]
                if max(wanted) < values.shape[1] == width:
                    return np.ascontiguousarray(values[:, list(wanted)]), []
        return self._slow(wanted, short_rows=short_rows)

    def texts(self, column: int) -> list[str]:
        """One column as text; empty where a row has no such cell."""
        return [cells[column].strip() if column < len(cells) else "" for cells in map(self.cells, self.rows)]

    def _fast(self) -> FloatArray:
        """All columns by numpy's reader; ValueError for anything that is not a number or a ragged row."""
        rows = [row.replace(",", ".") for row in self.rows] if self.decimal_comma else self.rows
        delimiter = None if self.delimiter == WHITESPACE else self.delimiter
        result: FloatArray = np.loadtxt(rows, delimiter=delimiter, comments=None, ndmin=2)
        return result

    def _slow(self, wanted: Sequence[int], *, short_rows: bool) -> tuple[FloatArray, list[Problem]]:
        """As `numbers`, in Python, with a verdict on each cell."""
        first = len(self.cells(self.rows[0]))
        width = len(self.names) if self.names is not None else first
        least = max(wanted) + 1
        values = np.zeros((len(self.rows), len(wanted)))  # a bad cell stays 0: it is complained of once
        complaints = _Complaints(self)
        for index, row in enumerate(self.rows):
            cells = self.cells(row)
            surplus = len(cells) - width
            if surplus == 1 and not cells[-1].strip():
                surplus = 0  # a delimiter at the end of the row
            if (surplus and not short_rows) or len(cells) < least:
                complaints.ragged(index, len(cells), width)
                continue
            for place, column in enumerate(wanted):
                cell = cells[column].strip()
                try:
                    values[index, place] = _number(cell.replace(",", ".") if self.decimal_comma else cell)
                except ValueError:
                    complaints.cell(index, column, cell)
        return values, complaints.problems()


class _Complaints:
    """Collects bad cells and rows of a table; one line per column, with the first place and the count."""

    def __init__(self, table: Table) -> None:
        self._table = table
        self._ragged: list[tuple[int, int, int]] = []
        self._cells: dict[int, list[tuple[int, str]]] = {}

    def ragged(self, index: int, count: int, width: int) -> None:
        self._ragged.append((index, count, width))

    def cell(self, index: int, column: int, text: str) -> None:
        self._cells.setdefault(column, []).append((index, text))

    def problems(self) -> list[Problem]:
        """The complaints as problems, in the order of their lines."""
        table, result = self._table, []
        if self._ragged:
            index, count, width = self._ragged[0]
            what = f"the row has {count} cells where {width} are due{_and_more(self._ragged)}"
            if len(self._ragged) == 1 and index == len(table.rows) - 1:
                mend = "the last row looks cut off: delete it"
            elif table.delimiter == "," and count in {2 * width, 2 * width - 1}:
                mend = "decimal commas cannot be told from separators: export with ';' or with points"
            else:
                mend = "mend or remove such rows"
            result.append(Problem(str(table.path), int(table.lines[index]), what, mend))
        for column, bad in self._cells.items():
            index, text = bad[0]
            name = table.names[column] if table.names is not None else f"column {column + 1}"
            if text:
                what, mend = (
                    f"{name} is not a number: {_shown(text)}",
                    "write a number there, or remove the row",
                )
                if re.fullmatch(r"[+-]?\d+,\d+", text):
                    mend = "a decimal comma? then say `decimal: comma` in the map"
            else:
                what, mend = f"{name} is empty", "fill in the value, or remove the row"
            result.append(Problem(str(table.path), int(table.lines[index]), what + _and_more(bad), mend))
        return sorted(result)


def _number(cell: str) -> float:
    """The number in a cell; ValueError for what only Python's own sources may write so, `1_0` for 10."""
    if "_" in cell:
        raise ValueError(cell)
    return float(cell)


def _and_more(bad: Sequence[object]) -> str:
    return f" (and so in {len(bad) - 1} more rows)" if len(bad) > 1 else ""


def _shown(text: str) -> str:
    return repr(text if len(text) <= 24 else text[:24] + "...")


def read_table(path: Path, data: bytes, layout: Layout) -> Table:
    """The table in `data`; InputError if it has no rows, no header where one is due, or is no text."""
    notes: list[str] = []
    text = decode(path, data, layout.encoding, notes)
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    rows = text.split("\n")
    numbers = np.arange(1, len(rows) + 1)
    rows, numbers = rows[layout.skip_lines :], numbers[layout.skip_lines :]
    while rows and not rows[-1].strip():
        rows.pop()
    numbers = numbers[: len(rows)]
    if layout.comment in text or not all(rows) or any(map(str.isspace, rows)):
        kept = [place for place, row in enumerate(rows) if _is_data(row, layout.comment)]
        rows, numbers = [rows[place] for place in kept], numbers[kept]
    if not rows:
        empty = "is empty" if not data.strip() else "holds no rows"
        raise InputError.at(path, empty, "export it again, or remove it")
    if layout.header:
        rows, numbers = _from_header(path, layout.header, rows, numbers)
    delimiter = layout.delimiter or _sniff_delimiter(rows[0])
    if layout.delimiter is None and delimiter != ",":
        notes.append(f"columns separated by {_DELIMITER_NAMES.get(delimiter, delimiter)}")
    names, header_line = None, None
    if layout.header != 0:
        names, header_line = _names(rows[0], delimiter), int(numbers[0])
        rows, numbers = rows[1:], numbers[1:]
        if not rows:
            raise InputError.at(
                path, "has a header but no rows", "export it again, or remove it", header_line
            )
    quoted = '"' in text and any('"' in row for row in rows)
    decimal_comma = _decimal_comma(layout, delimiter, rows, quoted=quoted)
    if decimal_comma and layout.decimal is None:
        notes.append("decimal commas read as points")
    return Table(path, names, header_line, rows, numbers, delimiter, decimal_comma, quoted, notes)


def _is_data(row: str, comment: str) -> bool:
    bare = row.lstrip()
    return bool(bare) and not bare.startswith(comment)


def _cells(row: str, delimiter: str) -> list[str]:
    """The cells of one line; quotes may hold delimiters."""
    if delimiter == WHITESPACE:
        return row.split()
    if '"' in row:
        with contextlib.suppress(csv.Error):  # a cell of more than 131,072 characters
            return next(csv.reader([row], delimiter=delimiter, skipinitialspace=True))
    return row.split(delimiter)


def _from_header(path: Path, line: int, rows: list[str], numbers: IntArray) -> tuple[list[str], IntArray]:
    """The rows from the header in a given line on."""
    place = int(np.searchsorted(numbers, line))
    if place >= len(numbers) or numbers[place] != line:
        raise InputError.at(path, f"line {line} cannot be the header", "correct `header` in the map")
    return rows[place:], numbers[place:]


def _names(row: str, delimiter: str) -> tuple[str, ...]:
    """The names in a header; empty ones at its end are none."""
    names = [" ".join(name.split()) for name in _cells(row, delimiter)]
    while len(names) > 1 and not names[-1]:
        names.pop()
    return tuple(names)


def _sniff_delimiter(row: str) -> str:
    """The delimiter by the first row: tab before semicolon before comma before blanks."""
    bare = re.sub(r'"[^"]*"', "", row)
    for delimiter in ("\t", ";", ","):
        if delimiter in bare:
            return delimiter
    return WHITESPACE if len(bare.split()) > 1 else ","


def _decimal_comma(layout: Layout, delimiter: str, rows: list[str], *, quoted: bool) -> bool:
    """Whether numbers have decimal commas: as the layout says, or as the first rows show."""
    if layout.decimal is not None:
        return layout.decimal == "comma"
    sample = rows[:200]
    if delimiter == ",":
        return quoted and any(_QUOTED_COMMA_NUMBER.search(row) for row in sample)
    return any(_COMMA_NUMBER.search(row) for row in sample)
