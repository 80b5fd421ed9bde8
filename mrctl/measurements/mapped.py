"""Applying a map: cells become channels in SI, recordings fall into runs, file names give values."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from mrctl.errors import InputError, Problem
from mrctl.measurements.assemble import RawRun
from mrctl.measurements.run import BY_ATTRIBUTE, BY_COLUMN
from mrctl.measurements.text import Table, read_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from mrctl.measurements.column_map import ColumnMap

_NAME_NUMBER = re.compile(r"-?\d+(?:[.,xp]\d+)?")


def read_mapped_text(path: Path, data: bytes, name: str, mapping: ColumnMap) -> list[RawRun]:
    """The runs in a text file, as the map says. InputError with all that is wrong."""
    table = read_table(path, data, mapping.layout)
    places = {attribute: _index(table, spec.column, mapping) for attribute, spec in mapping.places.items()}
    split = mapping.model.split
    events = None if split is None else _index(table, split.column, mapping)
    values, problems = table.numbers(list(places.values()), short_rows=split is not None)
    if problems:
        raise InputError(problems)
    columns = dict(zip(places, values.T, strict=True))
    parts = [slice(0, len(table.rows))] if events is None else _parts(table, events, mapping)
    runs = []
    for number, part in enumerate(parts):
        channels = {
            attribute: mapping.conversions[attribute](column[part]) for attribute, column in columns.items()
        }
        given = {} if split is None else split.values
        extra = {BY_COLUMN[column].attribute: of_parts[number] for column, of_parts in given.items()}
        run_name = name if len(parts) == 1 else f"{name}#{number + 1}"
        runs.append(finish(RawRun(run_name, path, channels, table.lines[part]), mapping, extra, table.notes))
    return runs


def finish(
    raw: RawRun, mapping: ColumnMap, extra: Mapping[str, float] | None = None, notes: Sequence[str] = ()
) -> RawRun:
    """`raw` completed by the map's constants, the values in the file's name and `extra`."""
    count = max((len(values) for values in raw.channels.values()), default=0)
    single = {**mapping.constants, **from_name(raw.file, mapping), **(extra or {})}
    said = [
        f"{BY_ATTRIBUTE[attribute].column} is {value:g} throughout" for attribute, value in single.items()
    ]
    return replace(
        raw,
        channels={
            **raw.channels,
            **{attribute: np.full(count, value) for attribute, value in single.items()},
        },
        rate_hz=mapping.model.sample_rate_hz if raw.rate_hz is None else raw.rate_hz,
        notes=[*notes, *raw.notes, *said],
        declared=frozenset(mapping.declared),
        hint=f"say where they are in {mapping.path}: `columns`, `constants` or `from_name`",
    )


def from_name(path: Path, mapping: ColumnMap) -> dict[str, float]:
    """Channel values that the file name holds; `x`, `p` or a comma may stand for the decimal point."""
    if mapping.pattern is None:
        return {}
    match = mapping.pattern.search(path.name)
    if match is None:
        mend = "correct the pattern, or choose the files with `files:`"
        raise InputError.at(path, f"the name does not match {mapping.pattern.pattern}", mend)
    result = {}
    for group, text in match.groupdict().items():
        channel = BY_COLUMN.get(group)
        if channel is None:
            continue
        if text is None or not _NAME_NUMBER.fullmatch(text):
            raise InputError.at(path, f"{group} in the name is no number: {text!r}", "correct the pattern")
        conversion = mapping.conversions[channel.attribute]
        result[channel.attribute] = conversion.factor * float(re.sub("[,xp]", ".", text)) + conversion.offset
    return result


def _index(table: Table, column: int | str, mapping: ColumnMap) -> int:
    """The place of a column from 0; InputError where the table has none such."""
    if isinstance(column, int):
        width = (
            len(table.names) if table.names is not None else max(map(len, map(table.cells, table.rows[:20])))
        )
        if column > width:
            what = f"there is no column {column}, only {width}"
            raise InputError.at(table.path, what, f"correct {mapping.path}", int(table.lines[0]))
        return column - 1
    if table.names is None:
        what = f"there is no header to find {column} in"
        raise InputError.at(table.path, what, f"give the column's number in {mapping.path}")
    found = [index for index, name in enumerate(table.names) if name == column]
    if len(found) != 1:
        what = f"{'no' if not found else 'more than one'} column is named {column}"
        mend = f"there are {', '.join(table.names)}: correct {mapping.path}"
        raise InputError([Problem(str(table.path), table.header_line, what, mend)])
    return found[0]


def _parts(table: Table, events: int, mapping: ColumnMap) -> list[slice]:
    """The rows of each run between the events."""
    split = mapping.model.split
    assert split is not None  # noqa: S101 - the caller has a column of events from it
    wanted = split.after if split.after is not None else split.before
    marks = [index for index, text in enumerate(table.texts(events)) if text == wanted]
    if not marks:
        what = f"no row has the event {wanted!r} in column {split.column}"
        raise InputError.at(table.path, what, f"correct `split` in {mapping.path}")
    cuts = [mark + 1 for mark in marks] if split.after is not None else marks
    bounds = sorted({0, *cuts, len(table.rows)})
    parts = [slice(low, high) for low, high in pairwise(bounds)]
    for name, given in split.values.items():
        if len(given) != len(parts):
            what = f"{len(parts)} parts, but `split` gives {len(given)} values of {name}"
            raise InputError.at(table.path, what, f"correct `split` in {mapping.path}")
    return parts
