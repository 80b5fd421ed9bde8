"""Chapter 5: the spread of g and h over the currents, and what f g h leaves of the backbones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.paper.identify import PaperSteps
from mrctl.report.series import Panel, Series
from mrctl.verify.entries import Entry, Span, largest, of_paper
from mrctl.verify.picture import Picture

Array = NDArray[np.float64]
Where = NDArray[np.bool_]

LOW_SPEED = 0.15  # of the largest: where the publication says that the on states differ too


def entries(steps: PaperSteps, on: Where, off: Where) -> list[Entry]:
    """The lines of Figs. 5.11 to 5.20."""
    t, e, c = steps.temperature, steps.estimate, steps.collapse
    v = steps.backbones.velocity_m_s
    fast = np.abs(v) > LOW_SPEED * float(np.max(np.abs(v)))
    two = on & (np.abs(_currents(steps) - 2.0) < 0.1)
    most = "backbones from f g h, {}, largest RMSE of the force"
    return [
        of_paper(
            "Fig. 5.11",
            "spread of g over the on states, above low speed, mean",
            "%",
            "much lower than all",
            100.0 * float(np.nanmean(c.std_on[fast])),
        ),
        of_paper(
            "Fig. 5.11", "the same over all states", "%", "-", 100.0 * float(np.nanmean(c.std_all[fast]))
        ),
        of_paper(
            "Fig. 5.15", "largest spread of h between the on currents", "%", "2.5", 100.0 * largest(t.std_on)
        ),
        of_paper("Fig. 5.17", "backbones over h, off, largest RMSE", "N", "about 15", largest(t.rmse_n[off])),
        of_paper(
            "Fig. 5.18",
            "the same of the force, on, largest",
            "%",
            "at or below 3",
            largest(t.rmse_percent[on]),
        ),
        of_paper("Fig. 5.18", "the same, off, largest", "%", "just above 5", largest(t.rmse_percent[off])),
        Entry(
            "Fig. 5.20",
            most.format("on"),
            "%",
            "never above 5",
            {"paper": largest(e.rmse_percent[on])},
            {"paper": Span(0.0, 5.0)},
        ),
        *(
            [
                of_paper(
                    "Fig. 5.20", "the same at 2 A, mean", "%", "around 1", float(np.mean(e.rmse_percent[two]))
                )
            ]
            if two.any()
            else []
        ),
        of_paper("Fig. 5.20", "the same, off, mean", "%", "10 to 13", float(np.mean(e.rmse_percent[off]))),
    ]


def pictures(steps: PaperSteps) -> list[Picture]:
    """Figs. 5.11 to 5.20 of the published method."""
    t, e, c, at = steps.temperature, steps.estimate, steps.collapse, steps.conditions
    v = steps.backbones.velocity_m_s
    spread = [Series("on states", v, 100.0 * c.std_on), Series("all states", v, 100.0 * c.std_all)]
    warm = at.temperature_c
    return [
        Picture(
            "Fig. 5.11",
            "spread of the normalised g over currents",
            "Velocity (m/s)",
            (Panel("Standard deviation (%)", spread),),
            "except at low speed the on states differ much less than all",
        ),
        Picture(
            "Fig. 5.15",
            "spread of h between the on currents",
            "Temperature (degC)",
            (Panel("Standard deviation (%)", [Series("on states", warm, 100.0 * t.std_on)]),),
            "at most 2.5 %",
        ),
        Picture(
            "Fig. 5.17",
            "backbones over h against the one at room temperature",
            "Temperature (degC)",
            (Panel("RMSE (N)", _by_current(steps, t.rmse_n)),),
            "off: rises to about 15 N, then about 10 N; on: rises with current and temperature",
        ),
        Picture(
            "Fig. 5.18",
            "the same in percent of the force",
            "Temperature (degC)",
            (Panel("RMSE (%)", _by_current(steps, t.rmse_percent)),),
            "on at or below 3 %, off just above 5 %",
        ),
        Picture(
            "Fig. 5.20",
            "backbones from f g h",
            "Temperature (degC)",
            (
                Panel("RMSE (N)", _by_current(steps, e.rmse_n), height=150.0),
                Panel("RMSE (%)", _by_current(steps, e.rmse_percent), height=150.0),
            ),
            "on never above 5 %, about 1 % at 2 A; off 10 to 13 %",
        ),
    ]


def _currents(steps: PaperSteps) -> Array:
    return np.array([r.current_a for r in steps.preparation.records])


def _by_current(steps: PaperSteps, values: Array) -> list[Series]:
    """A curve over temperature for each current."""
    at, warm = steps.conditions, np.array([r.temperature_c for r in steps.preparation.records])
    curves = []
    for c, level in enumerate(at.current_a):
        runs = at.runs_at(c)
        runs = runs[np.argsort(warm[runs])]
        curves.append(Series(f"{level:.3g} A", warm[runs], values[runs]))
    return curves
