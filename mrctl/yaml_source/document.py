"""What a YAML file said, where it said it, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mrctl.errors import InputError, Problem
from mrctl.printable import printable

KeyPath = tuple[str | int, ...]  # ("f", "force", "values", 3)


def dotted(path: KeyPath) -> str:
    """The path as a person writes it: `f.force.values[3]`; the index counts from 0."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.removeprefix(".")


@dataclass(frozen=True, slots=True)
class Document:
    """Plain data of one YAML document with line marks; keys are text, always."""

    file: str
    data: dict[str, Any]
    lines: Mapping[KeyPath, int]  # of a mapping's entry: the line of its key
    words: Mapping[KeyPath, str]  # how a plain (unquoted) scalar is written
    sha256: str
    slips: tuple[tuple[KeyPath, Problem], ...]  # what the reader found wrong

    def line(self, path: KeyPath) -> int | None:
        """The line of the value, or of the nearest block around it that exists."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.lines:
                return self.lines[path[:length]]
        return None


@dataclass(slots=True)
class Findings:
    """All problems of one document; a value that the reader already objected to is not judged twice."""

    document: Document
    problems: list[Problem] = field(default_factory=list)
    _objected: set[KeyPath] = field(default_factory=set)

    def __post_init__(self) -> None:
        for path, problem in self.document.slips:
            self.problems.append(problem)
            self._objected.add(path)

    def add(self, path: KeyPath, what: str, mend: str = "") -> None:
        """Note a problem with the value at a path."""
        if any(path[:length] in self._objected for length in range(1, len(path) + 1)):
            return
        line = self.document.line(path)
        self.problems.append(Problem(self.document.file, line, printable(what), printable(mend)))

    def raise_if_any(self) -> None:
        """Raises InputError with every problem, in the order of the lines."""
        if self.problems:
            raise InputError(sorted(set(self.problems), key=lambda p: (p.line or 0, p.what)))
