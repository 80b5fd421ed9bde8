"""Chapter 7: the forward model with each kind of filter, the better method and the models of others."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.paper.identify import PaperSteps
from mrctl.report.series import Mark, Panel, Series
from mrctl.verify.entries import Entry, Span, means
from mrctl.verify.picture import COLOURS, Picture

Array = NDArray[np.float64]
Where = NDArray[np.bool_]


def entries(steps: PaperSteps, forward: Mapping[str, Array], on: Where, off: Where) -> list[Entry]:
    """The lines of Figs. 7.2 and 7.3; forward: percent of the largest force by method (runs)."""
    errors = steps.forward_errors
    low, fir = errors.percent(errors.lowpass_n), errors.percent(errors.fir_n)
    what = "forward model, {}, mean RMSE of the force"
    better, worse = "minimally better than the IIR at 1 and 2 A", "worse than the IIR"
    goals = (
        {"paper": Span(2.0, 7.0), "best": Span(0.0, 2.0)},
        {"paper": Span(12.0, 15.0), "best": Span(0.0, 4.0)},
    )
    return [
        Entry("Fig. 7.3", what.format("on"), "%", "2 to 7", means(forward, on), goals[0], "forward, on, %"),
        Entry(
            "Fig. 7.3", what.format("off"), "%", "12 to 15", means(forward, off), goals[1], "forward, off, %"
        ),
        Entry("Fig. 7.3", "with the low-pass, on, mean", "%", better, means({"paper": low}, on)),
        Entry("Fig. 7.3", "with the low-pass, off, mean", "%", worse, means({"paper": low}, off)),
        Entry("Fig. 7.3", "with each run's own FIR, on, mean", "%", "the lowest", means({"paper": fir}, on)),
        Entry(
            "Fig. 7.3", "with each run's own FIR, off, mean", "%", "the lowest", means({"paper": fir}, off)
        ),
    ]


def pictures(steps: PaperSteps, forward: Mapping[str, Array], current_a: Array) -> list[Picture]:
    """Figs. 7.2 and 7.3 as published, and the same with all models."""
    e = steps.forward_errors
    kinds = {"own FIR": e.fir_n, "IIR": e.iir_n, "low-pass": e.lowpass_n}
    newtons = [over_runs(name, values) for name, values in kinds.items()]
    percent = [over_runs(name, e.percent(values)) for name, values in kinds.items()]
    marks = between(current_a)
    return [
        Picture(
            "Fig. 7.2",
            "forward model by filter",
            "Run",
            (Panel("RMSE (N)", newtons, marks),),
            "lowest with each run's own FIR filter",
        ),
        Picture(
            "Fig. 7.3",
            "forward model by filter, of the force",
            "Run",
            (Panel("RMSE (%)", percent, marks),),
            "on 2 to 7 %, off 12 to 15 % with the universal IIR filter",
        ),
        Picture(
            "Fig. 7.3",
            "the same for all models",
            "Run",
            (Panel("RMSE (%)", [over_runs(m, v) for m, v in forward.items()], marks),),
            note="Not in the publication: the better method, and models of others fitted to the same runs.",
        ),
    ]


def over_runs(label: str, values: Array) -> Series:
    """A value for each run, in the runs' order."""
    return Series(label, np.arange(1, values.size + 1), values, colour=COLOURS.get(label))


def between(current_a: Array) -> list[Mark]:
    """Lines where the current changes from run to run."""
    level = np.round(current_a, 1)
    starts = [0, *(np.flatnonzero(np.diff(level)) + 1)]
    return [Mark(k + 0.5, f"{current_a[k]:.3g} A", axis="x") for k in starts]
