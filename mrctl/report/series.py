"""What a plot shows: curves, reference marks, panels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from mrctl.report.decimate import Floats
from mrctl.report.theme import Tone

Numbers: TypeAlias = Sequence[float | None] | npt.NDArray[Any]
Style: TypeAlias = Literal["line", "dots", "step", "filled"]


@dataclass(frozen=True, slots=True)
class Series:
    """One curve: x and y of equal length; None, NaN and infinite values break the line.

    `style`: line, dots, step (holds each value until the next x), filled (steps down to the axis).
    `low` and `high` add a confidence band. `colour` is a number in the palette or a tone; without one, series
    take the palette's colours in order of appearance, and a label has the same colour in every panel.
    """

    label: str
    x: Numbers
    y: Numbers
    style: Style = "line"
    colour: int | Tone | None = None
    dashed: bool = False
    low: Numbers | None = None
    high: Numbers | None = None


@dataclass(frozen=True, slots=True)
class Mark:
    """A reference line at a value of an axis, or with `until` a shaded stretch; its label is beside it."""

    at: float
    label: str = ""
    axis: Literal["x", "y"] = "y"
    until: float | None = None
    tone: Tone = "soft"


@dataclass(frozen=True, slots=True)
class Panel:
    """A plot with its own y axis. `y_limits` overrides the range of the data; `zero` draws the zero lines."""

    y_label: str
    series: Sequence[Series]
    marks: Sequence[Mark] = ()
    y_log: bool = False
    y_limits: tuple[float, float] | None = None
    title: str = ""
    height: float = 220.0
    zero: bool = False


def floats(values: Numbers) -> Floats:
    """The values as an array; None becomes NaN."""
    return np.asarray(values, dtype=np.float64)
