"""The verification's lines, from the published protocol on the virtual damper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.calibration.filter_checks import cascade_error
from mrctl.identify.paper import identify_paper
from mrctl.identify.paper.identify import PaperSteps
from mrctl.measurements.run import Campaign
from mrctl.verify.best import Best, best_of
from mrctl.verify.entries import Entry, Span

Array = NDArray[np.float64]
Report = Callable[[float, str], None]

ON_A = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """All lines, and what the pictures need: each (runs)."""

    entries: tuple[Entry, ...]
    names: tuple[str, ...]
    current_a: Array
    forward_percent: dict[str, Array]
    returned_percent: dict[str, Array]
    mean_current_a: dict[str, Array]


def verify(campaign: Campaign, report: Report = lambda _share, _what: None) -> Verification:
    """Both methods on the campaign of the published protocol. Raises InputError where it is another one."""
    report(0.0, "the published method")
    steps = identify_paper(campaign).steps
    report(0.3, "the better method")
    best = best_of(campaign, steps.preparation)
    report(1.0, "done")
    records = steps.preparation.records
    current = np.array([r.current_a for r in records])
    on, off = current >= ON_A, current < ON_A
    errors = steps.forward_errors
    forward = {"paper": errors.percent(errors.iir_n), "best": best.forward_percent}
    returned = {"paper": steps.inverse_errors.rmse_percent, "best": best.returned_percent}
    mean = {"paper": steps.inverse_errors.mean_current_a, "best": best.mean_current_a}
    entries = (
        *_tables(steps, on, off),
        *_forward(steps, forward, on, off),
        *_inverse(steps, best, returned, on, off),
        *_currents(mean, current),
    )
    return Verification(entries, tuple(r.name for r in records), current, forward, returned, mean)


def _tables(steps: PaperSteps, on: NDArray[np.bool_], off: NDArray[np.bool_]) -> list[Entry]:
    t, e = steps.temperature, steps.estimate
    return [
        _line("Fig. 5.15", "largest spread of h between the on currents", "%", "2.5", 100.0 * _max(t.std_on)),
        _line("Fig. 5.17", "backbones over h, off, largest RMSE", "N", "about 15", _max(t.rmse_n[off])),
        _line(
            "Fig. 5.18",
            "the same of the force, on, largest",
            "%",
            "relatively small",
            _max(t.rmse_percent[on]),
        ),
        Entry(
            "Fig. 5.20",
            "backbones from f g h, on, largest RMSE of the force",
            "%",
            "never above 5",
            {"paper": _max(e.rmse_percent[on])},
            {"paper": Span(0.0, 5.0)},
        ),
    ]


def _forward(
    steps: PaperSteps, forward: dict[str, Array], on: NDArray[np.bool_], off: NDArray[np.bool_]
) -> list[Entry]:
    errors = steps.forward_errors
    low, fir = errors.percent(errors.lowpass_n), errors.percent(errors.fir_n)

    def line(what: str, published: str, where: NDArray[np.bool_], asked: Span, best: Span) -> Entry:
        ours = {method: float(values[where].mean()) for method, values in forward.items()}
        return Entry("Fig. 7.2", what, "%", published, ours, {"paper": asked, "best": best})

    return [
        line("forward model, on, mean RMSE of the force", "2 to 7", on, Span(2.0, 7.0), Span(0.0, 2.0)),
        line("forward model, off, mean RMSE of the force", "12 to 15", off, Span(12.0, 15.0), Span(0.0, 4.0)),
        _line(
            "Fig. 7.3", "with the first-order low-pass, on", "%", "worse than the IIR", float(low[on].mean())
        ),
        _line("Sec. 6.2", "with each run's own 500-tap FIR by LMS, on", "%", "-", float(fir[on].mean())),
    ]


def _inverse(
    steps: PaperSteps,
    best: Best,
    returned: dict[str, Array],
    on: NDArray[np.bool_],
    off: NDArray[np.bool_],
) -> list[Entry]:
    cascades = {
        "paper": cascade_error(steps.lower_order.iir, steps.inverse_filter),
        "best": cascade_error(best.damper.forward_filter, best.damper.inverse_filter),
    }
    flat = {method: Span(0.0, 0.75) for method in cascades}
    straight = {method: Span(0.0, 3.0) for method in cascades}
    means = [
        {method: float(values[where].mean()) for method, values in returned.items()} for where in (on, off)
    ]
    gains, phases = ({m: c[k] for m, c in cascades.items()} for k in (0, 1))
    through = "inverse then forward, {}, mean RMSE"
    return [
        Entry("Fig. 8.4", "forward times inverse filter to 20 Hz, gain", "dB", "flat", gains, flat),
        Entry("Fig. 8.4", "the same, phase", "deg", "flat", phases, straight),
        Entry("Fig. 9.5", through.format("on"), "%", "3.5", means[0], {"best": Span(0.0, 1.5)}),
        Entry("Fig. 9.5", through.format("off"), "%", "12", means[1], {"best": Span(0.0, 4.0)}),
    ]


def _currents(mean: dict[str, Array], current: Array) -> list[Entry]:
    lines = []
    for level in np.unique(np.round(current[current >= ON_A], 2)):
        here = np.abs(current - level) < 0.05
        worst = {method: _max(np.abs(values[here] - level)) for method, values in mean.items()}
        goal = {"best": Span(0.0, 0.1)}
        what = f"mean current found at {level:g} A, largest error over the runs"
        lines.append(Entry("Fig. 9.7", what, "A", "clear distinction", worst, goal))
    return lines


def _line(place: str, what: str, unit: str, published: str, value: float) -> Entry:
    return Entry(place, what, unit, published, {"paper": value}, {})


def _max(values: Array) -> float:
    return float(np.nanmax(values))
