"""MAT files: versions 4 to 7 through scipy, 7.3 (HDF5) through h5py; variables, fields and matrix columns."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrctl.errors import InputError, Problem
from mrctl.measurements.assemble import RawRun
from mrctl.measurements.column_map import ColumnMap
from mrctl.measurements.external import damage_is_input_error, library
from mrctl.measurements.mapped import finish
from mrctl.measurements.run import BY_ATTRIBUTE, BY_COLUMN, FloatArray

_PLACE = re.compile(r"(?P<path>[A-Za-z]\w*(?:\.[A-Za-z]\w*)*)(?:\(:,\s*(?P<column>\d+)\))?")
_HDF5 = b"\x89HDF"

Tree = Mapping[str, Any]


def read_mat(path: Path, data: bytes, name: str, mapping: ColumnMap | None) -> RawRun:
    """The run in a MAT file: variables with the interface's names, or those of a map. InputError if not."""
    tree = _hdf5(path, data) if _HDF5 in data[:1024] else _scipy(path, data)
    if mapping is None:
        tree = _interface(tree)
        places = {BY_COLUMN[column].attribute: column for column in tree if column in BY_COLUMN}
        if not places:
            shown = ", ".join(sorted(tree)[:12]) or "nothing"
            mend = "name variables as the interface does, or say with --columns MAP.yaml which is which"
            raise InputError.at(path, f"no variable has one of the interface's names (it has {shown})", mend)
    else:
        places = {attribute: str(spec.column) for attribute, spec in mapping.places.items()}
    channels, problems = {}, []
    for attribute, place in places.items():
        values, complaint = _values(tree, place)
        if values is None:
            there = ", ".join(sorted(tree)[:12])
            problems.append(Problem(str(path), None, complaint, f"the file has {there}: correct the map"))
        else:
            channels[attribute] = values if mapping is None else mapping.conversions[attribute](values)
    problems = problems or _lengths(path, channels, places)
    if problems:
        raise InputError(problems)
    raw = RawRun(name, path, *_spread(channels))
    return finish(raw, mapping) if mapping is not None else raw


def _scipy(path: Path, data: bytes) -> Tree:
    """Versions 4 to 7."""
    matlab = library("scipy.io.matlab", path, "MAT")
    with damage_is_input_error(path, "MAT", matlab.MatReadError):
        loaded = matlab.loadmat(io.BytesIO(data), squeeze_me=True, simplify_cells=True)
    return {name: value for name, value in loaded.items() if not name.startswith("__")}


def _hdf5(path: Path, data: bytes) -> Tree:
    """Version 7.3; HDF5 stores MATLAB's matrices turned over."""
    h5py = library("h5py", path, "MAT 7.3")

    def branch(group: Any) -> dict[str, Any]:  # noqa: ANN401 - h5py has no types
        return {
            name: branch(item) if isinstance(item, h5py.Group) else np.squeeze(np.asarray(item).T)
            for name, item in group.items()
            if not name.startswith("#")
        }

    with damage_is_input_error(path, "MAT 7.3"), h5py.File(io.BytesIO(data), "r") as file:
        return branch(file)


def _interface(tree: Tree) -> Tree:
    """The tree itself, or the one struct in it whose fields have the interface's names."""
    if any(name in BY_COLUMN for name in tree):
        return tree
    structs = [value for value in tree.values() if isinstance(value, dict) and set(value) & set(BY_COLUMN)]
    return structs[0] if len(structs) == 1 else tree


def _values(tree: Tree, place: str) -> tuple[FloatArray | None, str]:
    """The numbers at a place like `log.v` or `data(:,3)`, (n,); None and what is wrong if there are none."""
    match = _PLACE.fullmatch(place)
    if match is None:
        return None, f"{place!r} names no variable: write like log.v or data(:,3)"
    value: Any = tree
    for part in match["path"].split("."):
        if not isinstance(value, Mapping) or part not in value:
            return None, f"there is no {match['path']}"
        value = value[part]
    array = np.asarray(value)
    if array.dtype.kind not in "fiub":
        return None, f"{match['path']} holds no plain numbers (a table or object? save arrays instead)"
    if match["column"] is not None:
        column = int(match["column"])
        if array.ndim != 2 or not 1 <= column <= array.shape[1]:
            return (
                None,
                f"{match['path']} has no column {column} (its size is {'x'.join(map(str, array.shape))})",
            )
        array = array[:, column - 1]
    if array.ndim > 1:
        return None, f"{place} is a matrix of {'x'.join(map(str, array.shape))}: write {place}(:,1)"
    return np.atleast_1d(array.astype(np.float64)), ""


def _lengths(path: Path, channels: dict[str, FloatArray], places: dict[str, str]) -> list[Problem]:
    """A problem where channels are neither as long as the longest, nor single values."""
    count = max(map(len, channels.values()))
    odd = [
        f"{places[name]} has {len(values)}"
        for name, values in channels.items()
        if len(values) not in {1, count}
    ]
    if not odd:
        return []
    return [
        Problem(str(path), None, f"{', '.join(odd)} values where {count} are due", "make them equally long")
    ]


def _spread(channels: dict[str, FloatArray]) -> tuple[dict[str, FloatArray], None, None, list[str]]:
    """Single values stand for all rows. The result fits RawRun: channels, no lines, no rate, notes."""
    count = max(map(len, channels.values()))
    notes = [
        f"{BY_ATTRIBUTE[name].column} is {values[0]:g} throughout"
        for name, values in channels.items()
        if len(values) == 1 < count
    ]
    spread = {
        name: np.full(count, values[0]) if len(values) == 1 else values for name, values in channels.items()
    }
    return spread, None, None, notes
