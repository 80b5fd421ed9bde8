"""The verification as a whole: every line and figure, from the published protocol."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrctl.errors import InputError
from mrctl.identify.baselines import BaselineFit
from mrctl.identify.paper import identify_paper
from mrctl.measurements.run import Campaign
from mrctl.plant.dyno.parameters import DynoDamper
from mrctl.plant.dyno.protocols import Drive
from mrctl.verify import forward, hysteresis, inverse, separable, spencer_pictures
from mrctl.verify.best import best_of
from mrctl.verify.entries import Entry
from mrctl.verify.others import others_of
from mrctl.verify.picture import Picture
from mrctl.verify.signals import signals_of
from mrctl.verify.spencer import spencer

Array = NDArray[np.float64]
Report = Callable[[float, str], None]

ON_A = 0.5
SHARES = {"paper": 0.0, "best": 0.12, "others": 0.3, "inverse": 0.5, "spencer": 0.55}  # of the time


@dataclass(frozen=True, slots=True, eq=False)
class Chapter:
    """What belongs together on the page."""

    title: str
    entries: tuple[Entry, ...]
    pictures: tuple[Picture, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """All lines and figures by chapter, the names of the runs, and the fits of the models of others."""

    chapters: tuple[Chapter, ...]
    names: tuple[str, ...]
    fits: tuple[BaselineFit, ...]

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Those of all chapters."""
        return tuple(entry for chapter in self.chapters for entry in chapter.entries)

    def figures(self) -> dict[str, Any]:
        """For JSON: every line and every curve."""
        return {
            "entries": [entry.figures() for entry in self.entries],
            "pictures": [picture.numbers() for chapter in self.chapters for picture in chapter.pictures],
            "baselines": {fit.name: _baseline(fit) for fit in self.fits},
            "runs": len(self.names),
        }


def verify(
    campaign: Campaign,
    report: Report = lambda _share, _what: None,
    virtual: tuple[DynoDamper, Sequence[Drive]] | None = None,
    *,
    with_spencer: bool = True,
    seed: int = 1,
) -> Verification:
    """All methods on the campaign of the published protocol.

    virtual: the damper that was measured and what drove it in each run, where it is a virtual one: then each
    inverse's current is tried on it. Raises InputError where the campaign is of another protocol.
    """
    _require_on_and_off(campaign)
    report(SHARES["paper"], "the published method")
    found = identify_paper(campaign)
    steps = found.steps
    signals = signals_of(campaign, steps.preparation)
    report(SHARES["best"], "the better method")
    best = best_of(campaign, signals)
    width = SHARES["inverse"] - SHARES["others"]
    others = others_of(
        campaign, signals, found.damper, lambda share, what: report(SHARES["others"] + width * share, what)
    )
    report(SHARES["inverse"], "the inverses on the damper")
    current = np.array([r.current_a for r in steps.preparation.records])
    on, off = current >= ON_A, current < ON_A
    e = steps.forward_errors
    forwards = {"paper": e.percent(e.iir_n), "best": best.forward_percent, **others.forward_percent}
    by_paper = inverse.whole_currents(steps, found.damper.current_max_a)
    asked = {"paper": by_paper, "best": best.asked_a, **others.asked_a}
    mean = inverse.mean_currents(asked, signals)
    into = {} if virtual is None else inverse.into_damper(*virtual, asked, signals)
    kept = {
        name: [s.record.cut(i) for s, i in zip(signals, currents, strict=True)]
        for name, currents in others.asked_a.items()
    }
    chapters = [
        Chapter(
            "The separable model (Ch. 5)",
            tuple(separable.entries(steps, on, off)),
            tuple(separable.pictures(steps)),
        ),
        Chapter(
            "The hysteresis filter and its inverse (Ch. 6, 8)",
            tuple(hysteresis.entries(steps, best.damper)),
            tuple(hysteresis.pictures(steps, best.damper)),
        ),
        Chapter(
            "The forward model (Ch. 7)",
            tuple(forward.entries(steps, forwards, on, off)),
            tuple(forward.pictures(steps, forwards, current)),
        ),
        Chapter(
            "The inverse (Sec. 9.2)",
            tuple(inverse.entries(steps, best, into, mean, current, on, off)),
            tuple(inverse.pictures(steps, best, into, mean, kept, current)),
        ),
    ]
    if with_spencer:
        rest = 1.0 - SHARES["spencer"]
        result = spencer(seed, lambda share, what: report(SHARES["spencer"] + rest * share, what))
        shown = tuple(spencer_pictures.pictures(result))
        chapters.append(Chapter("Spencer's damper (Sec. 9.3)", result.entries, shown))
    report(1.0, "done")
    names = tuple(r.name for r in steps.preparation.records)
    return Verification(tuple(chapters), names, others.fits)


def _require_on_and_off(campaign: Campaign) -> None:
    """Raises InputError where no run is with, or none without current: half of the lines would be empty."""
    levels = np.array([float(np.median(run.current_a)) for run in campaign.runs if run.has_current])
    for name, seen in (("with", levels >= ON_A), ("without", levels < ON_A)):
        if not seen.any():
            raise InputError.at(
                campaign.root,
                f"has no run {name} current; the published protocol has 0, 1, 2 and 3 A",
                f"add runs {name} current, or use `mrctl identify` and `mrctl compare`",
            )


def _baseline(fit: BaselineFit) -> dict[str, Any]:
    e = fit.errors
    return {
        "rmse_n": e.rmse_n,
        "fit_percent": e.fit_percent,
        "rmse_percent_on": e.rmse_percent_on,
        "rmse_percent_off": e.rmse_percent_off,
        "parameters": {name: {"value": q.value, "unit": q.unit} for name, q in fit.parameters.items()},
    }
