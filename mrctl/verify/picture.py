"""A published figure as ours: the curves, drawn for the page and as numbers for JSON."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from mrctl.report.plots import loop_plot, panels_plot, small_multiples
from mrctl.report.series import Panel, Series, floats
from mrctl.report.svg import Figure
from mrctl.verify.entries import METHODS

Array = NDArray[np.float64]

NOTHING = "-"  # is published in numbers or words
COLOURS: dict[str, int] = {method: k for k, method in enumerate(METHODS)}  # the same in all figures
HALF_TURN = 180.0
DIGITS = 5  # of a number in JSON
POINTS = 800  # of a signal over time, in page and JSON


@dataclass(frozen=True, slots=True)
class Picture:
    """`published`: what the publication's text says of its figure, in short; `note`: what ours shows."""

    place: str
    title: str
    x_label: str
    panels: tuple[Panel, ...]
    published: str = NOTHING
    note: str = ""
    kind: Literal["lines", "loop", "multiples"] = "lines"
    x_log: bool = False

    def figure(self) -> Figure:
        """Drawn."""
        title = f"{self.place}: {self.title}"
        if self.kind == "loop":
            (panel,) = self.panels
            return loop_plot(title, self.x_label, panel.y_label, panel.series, half=False)
        if self.kind == "multiples":
            return small_multiples(title, self.x_label, self.panels, columns=2, x_log=self.x_log)
        return panels_plot(title, self.x_label, self.panels, x_log=self.x_log)

    def caption(self) -> str:
        """Under the figure."""
        words = [] if self.published == NOTHING else [f"Published: {self.published}."]
        return " ".join([*words, self.note] if self.note else words)

    def numbers(self) -> dict[str, Any]:
        """For JSON: every curve."""
        return {
            "place": self.place,
            "title": self.title,
            "published": self.published,
            "x_label": self.x_label,
            "panels": [
                {
                    "title": panel.title,
                    "y_label": panel.y_label,
                    "series": [
                        {"label": s.label, "x": _rounded(floats(s.x)), "y": _rounded(floats(s.y))}
                        for s in panel.series
                    ],
                }
                for panel in self.panels
            ],
        }


def over_time(label: str, x: Array, y: Array) -> Series:
    """A method's signal over time or over another, as many points as a page can show."""
    every = max(1, x.size // POINTS)
    return Series(label, x[::every], y[::every], colour=COLOURS.get(label, "ink"))


def bode(
    place: str, title: str, curves: list[tuple[str, Array, NDArray[np.complex128]]], **words: str
) -> Picture:
    """Gain and phase of some frequency responses: (label, frequencies in Hz, response)."""
    gain = [Series(n, f, 20.0 * np.log10(np.maximum(np.abs(h), 1e-6))) for n, f, h in curves]
    phase = [Series(n, f, _phase(h)) for n, f, h in curves]
    panels = (Panel("Gain (dB)", gain, height=170.0), Panel("Phase (deg)", phase, height=150.0))
    return Picture(place, title, "Frequency (Hz)", panels, x_log=True, **words)  # type: ignore[arg-type]  # words are texts


def _phase(response: NDArray[np.complex128]) -> Array:
    """In degrees, without a line from one end of the circle to the other."""
    degrees = np.degrees(np.angle(response))
    degrees[1:][np.abs(np.diff(degrees)) > HALF_TURN] = np.nan
    return np.asarray(degrees, dtype=np.float64)


def _rounded(values: Array) -> list[float | None]:
    return [float(f"{v:.{DIGITS}g}") if math.isfinite(v) else None for v in values.tolist()]
