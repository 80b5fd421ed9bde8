"""What the quality gate says: one line per defect, as an error (no honest fit is possible) or a warning."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mrctl.errors import Problem
from mrctl.measurements.run import FloatArray, Run


@dataclass(frozen=True, slots=True)
class Finding:
    """One defect of a run: where it shows first (`row`: line of the file), what it is, how to mend it."""

    level: Literal["error", "warning"]
    file: str
    row: int | None
    what: str
    mend: str = ""

    @property
    def problem(self) -> Problem:
        """The finding as errors and warnings are printed."""
        return Problem(self.file, self.row, self.what, self.mend)

    def __str__(self) -> str:
        return f"{self.level}: {self.problem}"


def error(run: Run, index: int | None, what: str, mend: str) -> Finding:
    """An error at sample `index` of a run."""
    return Finding("error", str(run.file), None if index is None else run.row(index), _named(run, what), mend)


def warning(run: Run, index: int | None, what: str, mend: str) -> Finding:
    """A warning at sample `index` of a run."""
    return Finding(
        "warning", str(run.file), None if index is None else run.row(index), _named(run, what), mend
    )


def _named(run: Run, what: str) -> str:
    """A file of several runs says in which one."""
    part = run.name.rpartition("#")[2] if "#" in run.name else ""
    return f"run {part}: {what}" if part else what


def stretches(mask: FloatArray | np.ndarray) -> Iterator[tuple[int, int]]:
    """Start and end (exclusive) of each stretch of true values."""
    edges = np.flatnonzero(
        np.diff(np.concatenate(([False], np.asarray(mask, dtype=bool), [False])).astype(int))
    )
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        yield int(start), int(end)


def spread(values: FloatArray) -> float:
    """Highest less lowest value."""
    return float(values.max() - values.min())


def inner(left: FloatArray, right: FloatArray) -> float:
    """The scalar product; not by BLAS, whose threads cost more than they bring at this size."""
    return float(np.sum(left * right))
