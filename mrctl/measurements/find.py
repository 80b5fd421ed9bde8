"""The measurement files below a path, in stable order; what is left out is said."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from mrctl.errors import InputError, Problem
from mrctl.measurements.column_schema import MapModel

SUFFIXES = {
    ".csv": "text",
    ".mat": "mat",
    ".mf4": "mdf",
    ".mdf": "mdf",
    ".log": "can",
    ".asc": "can",
    ".blf": "can",
    ".trc": "can",
}
"""Format by extension. A map names other extensions by its `files:`."""
_PLAIN = {".csv", ".mat", ".mf4", ".mdf"}
"""What a folder is searched for when there is no map: formats that carry channel names."""


@dataclass(slots=True)
class Found:
    """Files with their names below the root (POSIX, as run names), and warnings about what was left out."""

    root: Path
    files: list[tuple[Path, str]] = field(default_factory=list)
    warnings: list[Problem] = field(default_factory=list)


def format_of(file: Path, model: MapModel | None) -> str:
    """How to read a file: as its map says, else by its extension, else as text."""
    by_suffix = SUFFIXES.get(file.suffix.lower(), "text")
    if model is None:
        return by_suffix
    if model.format is not None:
        return model.format
    if model.dbc is None and file.suffix.lower() in {".log", ".asc"}:
        return "text"  # common names for tables too
    return "can" if model.dbc is not None else by_suffix


def find_files(path: Path | str, patterns: tuple[str, ...] = ()) -> Found:
    """The measurements at `path`: itself if it is a file, else all below it that match.

    `patterns` are globs on the file name; without them the extensions that need no map. Links are followed, a
    folder is visited once. InputError where there is nothing to read.
    """
    root = Path(path)
    try:
        if root.is_dir():
            return _search(root, patterns)
        if root.exists():
            return Found(root, [(root, root.name)])
    except (OSError, ValueError) as error:
        raise InputError.at(
            path, f"cannot be read: {getattr(error, 'strerror', None) or error}", "check the path"
        ) from None
    what = "is a link to nothing" if root.is_symlink() else "there is no such file or folder"
    raise InputError.at(path, what, "check the path")


def _search(root: Path, patterns: tuple[str, ...]) -> Found:
    """All files below `root` that match, depth first, by name."""
    walk = _Walk(Found(root), patterns)
    walk.folder(root, "")
    if walk.problems:
        raise InputError(walk.problems)
    if not walk.found.files:
        raise _nothing(root, patterns, walk.others)
    return walk.found


@dataclass(slots=True)
class _Walk:
    """A walk through folders that visits each once, by whatever links."""

    found: Found
    patterns: tuple[str, ...]
    visited: set[str] = field(default_factory=set)
    others: Counter[str] = field(default_factory=Counter)
    problems: list[Problem] = field(default_factory=list)

    def folder(self, folder: Path, prefix: str) -> None:
        """Take in all that lies in a folder and below."""
        try:
            real = os.path.realpath(folder, strict=True)
            if real in self.visited:
                self._warn(folder, "a link to a folder that is read already; not read again")
                return
            self.visited.add(real)
            entries = sorted(folder.iterdir(), key=lambda entry: entry.name)
        except OSError as error:
            what = f"cannot be read: {error.strerror or error}"
            self.problems.append(Problem(str(folder), None, what, "check its permissions"))
            return
        for entry in entries:
            self._entry(entry, prefix + entry.name)

    def _entry(self, entry: Path, name: str) -> None:
        """One file or folder."""
        matches = _matches(entry, self.patterns)
        if entry.name.startswith((".", "~$")):
            if matches:
                self._warn(entry, "a hidden file; not read")
        elif entry.is_dir():
            self.folder(entry, name + "/")
        elif matches and not entry.is_file() and not entry.is_symlink():
            self._warn(entry, "no ordinary file (a pipe or device); not read")
        elif matches:
            self.found.files.append((entry, name))
        else:
            self.others[entry.suffix.lower() or "without extension"] += 1

    def _warn(self, place: Path, what: str) -> None:
        self.found.warnings.append(Problem(str(place), None, what))


def _matches(entry: Path, patterns: tuple[str, ...]) -> bool:
    if patterns:
        return any(entry.match(pattern) for pattern in patterns)
    return entry.suffix.lower() in _PLAIN


def _nothing(root: Path, patterns: tuple[str, ...], others: Counter[str]) -> InputError:
    wanted = ", ".join(patterns) if patterns else "CSV, MAT or MDF"
    there = ", ".join(f"{count} {suffix}" for suffix, count in others.most_common(4))
    what = f"no {wanted} file in this folder" + (f" (but {there})" if there else "")
    mend = (
        "correct `files:` in the map"
        if patterns
        else "for other files, say how to read them with --columns MAP.yaml"
    )
    return InputError.at(root, what, mend if there or patterns else "check the path")
