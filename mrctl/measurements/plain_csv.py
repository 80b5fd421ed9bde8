"""A CSV with the interface's own column names: nothing to be told, little to be guessed."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

from mrctl.errors import InputError, Problem
from mrctl.measurements.assemble import RawRun
from mrctl.measurements.run import BY_COLUMN, CHANNELS
from mrctl.measurements.text import Layout, Table, read_table

if TYPE_CHECKING:
    from pathlib import Path

NOT_USED = "columns not used: "
_BY_LOWER = {channel.column.lower(): channel for channel in CHANNELS}


def read_plain_csv(path: Path, data: bytes, name: str) -> RawRun:
    """The channels of an interface CSV. InputError with all that is wrong in it."""
    table = read_table(path, data, Layout())
    names = table.names or ()
    if names and all(map(_is_number, names)):
        mend = "add a row of column names, or say what the columns are with --columns MAP.yaml (header: 0)"
        raise InputError.at(
            path, "the first row holds numbers where column names are due", mend, table.header_line
        )
    places, notes = _places(table, names)
    if not places:
        raise InputError([Problem(str(path), table.header_line, *_strangers(names))])
    values, problems = table.numbers(list(places.values()))
    unused = [column for index, column in enumerate(names) if index not in places.values()]
    if unused:
        notes.append(NOT_USED + ", ".join(unused))
    hint = _hint(unused)
    channels = {attribute: values[:, index].copy() for index, attribute in enumerate(places)}
    return RawRun(
        name, path, channels, table.lines, notes=[*table.notes, *notes], hint=hint, problems=problems
    )


def _places(table: Table, names: tuple[str, ...]) -> tuple[dict[str, int], list[str]]:
    """Where each channel stands; a name in other case is taken with a note, a name given twice is refused."""
    places: dict[str, int] = {}
    notes: list[str] = []
    problems = []
    for index, written in enumerate(names):
        channel = BY_COLUMN.get(written) or _BY_LOWER.get(written.lower())
        if channel is None:
            continue
        if channel.attribute in places:
            first = places[channel.attribute] + 1
            what = f"column {channel.column} is there twice (columns {first} and {index + 1})"
            problems.append(Problem(str(table.path), table.header_line, what, "rename or remove one of them"))
            continue
        places[channel.attribute] = index
        if written != channel.column:
            notes.append(f"column {written} read as {channel.column}")
    if problems:
        raise InputError(problems)
    return places, notes


def _strangers(names: tuple[str, ...]) -> tuple[str, str]:
    """What and mend for a header without a single known name."""
    shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    what = f"no known column name in the header ({shown or 'which is blank'})"
    known = ", ".join(channel.column for channel in CHANNELS[:5])
    return what, f"name the columns {known}, or say with --columns MAP.yaml which is which"


def _hint(unused: list[str]) -> str:
    """The mend for a missing column, naming those that look like one."""
    pairs = []
    for channel in CHANNELS:
        stem = channel.column.split("_")[0]
        alike = [name for name in unused if stem in name.lower()] or difflib.get_close_matches(
            channel.column, unused, n=1
        )
        if alike:
            pairs.append(f"{alike[0]} for {channel.column}")
            unused = [name for name in unused if name != alike[0]]
    mend = "rename or add columns, or say with --columns MAP.yaml what stands where"
    return f"is it {', '.join(pairs)}? {mend} (in which unit)" if pairs else mend


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
