"""One line of the verification: a published figure, what each method reaches here, and what is asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


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
    """A figure of the publication and ours; `goal`: method to the span that is asked of it."""

    place: str  # where it stands in the publication
    what: str
    unit: str
    published: str
    ours: Mapping[str, float]
    goal: Mapping[str, Span]

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
            "ours": dict(self.ours),
            "goal": {method: [span.low, span.high] for method, span in self.goal.items()},
            "met": {method: self.met(method) for method in self.goal},
        }
