"""What can go wrong, as a tree: what a user reads, and the exit status that goes with it.

    MrctlError                 status 1: something failed while running
      InputError               status 2: a file or value that a person gave is unusable
      BusError                 status 1: the CAN interface refuses (missing, down, wrong mode)

Every message says what is wrong and the mend, so that one line is enough.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from mrctl.printable import printable

FILES_TOLD = 3  # that have the same problem are named one by one


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """One thing wrong with an input: where it stands, what it is, how to mend it."""

    file: str
    line: int | None
    what: str
    mend: str = ""

    def __str__(self) -> str:
        """`FILE[:LINE]: what is wrong; the mend`, on one line whatever a file is called."""
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        return printable(f"{place}: {self.what}" + (f"; {self.mend}" if self.mend else ""))


def lines_of(problems: Iterable[Problem]) -> list[str]:
    """The problems, a line each; of those that many files have alike, the first and how many more have it."""
    every = list(problems)
    files: dict[tuple[int | None, str, str], dict[str, None]] = {}
    for problem in every:
        files.setdefault((problem.line, problem.what, problem.mend), {})[problem.file] = None
    lines, told = [], set()
    for problem in every:
        alike = problem.line, problem.what, problem.mend
        more = len(files[alike]) - 1
        if more < FILES_TOLD:
            lines.append(str(problem))
        elif alike not in told:
            told.add(alike)
            last = printable(list(files[alike])[-1])
            lines.append(f"{problem} (the same in {more} more files, the last of them {last})")
    return lines


class MrctlError(Exception):
    """Base of all errors that mrctl raises on purpose; a failure at run time."""

    exit_status = 1


class BusError(MrctlError):
    """A CAN interface cannot be used. Example: `can0` does not exist."""


class InputError(MrctlError):
    """Unusable input, with all that is wrong in it at once. Example: a calibration with an unsorted table."""

    exit_status = 2

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    @classmethod
    def at(cls, file: str | Path, what: str, mend: str = "", line: int | None = None) -> InputError:
        """The error with a single problem."""
        return cls([Problem(str(file), line, what, mend)])
