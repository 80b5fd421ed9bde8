"""One line of the verification: a published figure, what each method reaches here, and what is asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.baselines import BASELINES

Array = NDArray[np.float64]

OWN = ("paper", "best")
METHODS = (*OWN, *BASELINES)


@dataclass(frozen=True, slots=True)
class Span:
    """Values from low to high count as met."""

    low: float
    high: float

    def __contains__(self, value: object) -> bool:
        return isinstance(value, float) and self.low <= value <= self.high

    def __str__(self) -> str:
        return f"≤ {self.high:g}" if self.low <= 0.0 else f"{self.low:g} to {self.high:g}"


@dataclass(frozen=True, slots=True)
class Entry:
    """A figure of the publication and ours; `goal`: method to the span that is asked of it.

    `short` names the column where all models stand side by side.
    """

    place: str  # where it stands in the publication
    what: str
    unit: str
    published: str
    ours: Mapping[str, float]
    goal: Mapping[str, Span] = field(default_factory=dict)
    short: str = ""

    def met(self, method: str) -> bool | None:
        """Whether a method reaches what is asked of it; None where nothing is."""
        goal = self.goal.get(method)
        return None if goal is None else float(self.ours[method]) in goal

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "place": self.place,
            "what": self.what,
            "unit": self.unit,
            "published": self.published,
            "ours": {method: float(value) for method, value in self.ours.items()},
            "goal": {method: [span.low, span.high] for method, span in self.goal.items()},
            "met": {method: self.met(method) for method in self.goal},
        }


def of_paper(place: str, what: str, unit: str, published: str, value: float) -> Entry:
    """A line of which only the published method knows."""
    return Entry(place, what, unit, published, {"paper": value})


def largest(values: Array) -> float:
    """The largest value that there is."""
    return float(np.nanmax(values))


def means(values: Mapping[str, Array], where: NDArray[np.bool_]) -> dict[str, float]:
    """Each method's mean over some runs."""
    return {method: float(one[where].mean()) for method, one in values.items()}
