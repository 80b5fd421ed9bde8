"""Chapter 6 and Sec. 8.1: the adaptive filters, their average, the low-order filters and the inverse."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.calibration.filter_checks import cascade_error
from mrctl.identify.paper.fir import AdaptiveFilter
from mrctl.identify.paper.identify import PaperSteps
from mrctl.identify.paper.response import fir_response
from mrctl.model.damper import Damper
from mrctl.model.filters import Filter
from mrctl.report.series import Panel, Series
from mrctl.verify.entries import Entry, Span, largest, of_paper
from mrctl.verify.picture import Picture, bode

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LOWEST_HZ = 2.0  # near the motion's frequency: below it the filters have heard nothing
POINTS = 120  # of a response
HIGHEST = 0.45  # of the sample rate
LATE = 0.9  # of all passes: converged, if little happens after


def entries(steps: PaperSteps, best: Damper) -> list[Entry]:
    """The lines of Figs. 6.2 to 6.5 and 8.4."""
    runs, peak = steps.filters.runs, steps.forward_errors.peak_n
    late = [_late_change(run.passes, run.mse_n2) for run in runs]
    left = 100.0 * np.sqrt([run.mse_n2[-1] for run in runs]) / peak
    least = 100.0 * np.sqrt([run.mse_least_squares_n2 for run in runs]) / peak
    f, by_run, mean = _responses(steps)
    gain = 20.0 * np.log10(np.abs(by_run[:, 0]) / np.abs(mean[0]))
    phase = np.degrees(np.angle(by_run[:, 0] / mean[0]))
    cascades = {
        "paper": cascade_error(steps.lower_order.iir, steps.inverse_filter),
        "best": cascade_error(best.forward_filter, best.inverse_filter),
    }
    gains, phases = ({m: c[k] for m, c in cascades.items()} for k in (0, 1))
    low = steps.lower_order
    alike = f"filters of all runs at {f[0]:.3g} Hz, spread of the {{}}"
    return [
        of_paper(
            "Fig. 6.2",
            "mean square error, change over the last tenth of the passes, median",
            "%",
            "no longer decreasing",
            100.0 * float(np.median(late)),
        ),
        of_paper("Fig. 6.2", "RMSE that LMS leaves, of the force, largest", "%", "-", largest(left)),
        of_paper("Fig. 6.2", "that least squares would leave, largest", "%", "-", largest(least)),
        of_paper("Fig. 6.4", alike.format("gain"), "dB", "very similar", float(np.std(gain))),
        of_paper("Fig. 6.4", alike.format("phase"), "deg", "very similar", float(np.std(phase))),
        of_paper("Fig. 6.5", "misfit of the third-order filter", "%", "excellent", 100.0 * low.misfit_iir),
        of_paper(
            "Fig. 6.5", "misfit of the first-order low-pass", "%", "not the phase", 100.0 * low.misfit_lowpass
        ),
        Entry(
            "Fig. 8.4",
            "forward times inverse filter to 20 Hz, gain",
            "dB",
            "flat",
            gains,
            {method: Span(0.0, 0.75) for method in cascades},
        ),
        Entry(
            "Fig. 8.4",
            "the same, phase",
            "deg",
            "flat",
            phases,
            {method: Span(0.0, 3.0) for method in cascades},
        ),
    ]


def pictures(steps: PaperSteps, best: Damper) -> list[Picture]:
    """Figs. 6.2 to 6.5 and 8.4."""
    f, by_run, _ = _responses(steps)
    level = steps.conditions.current_a[steps.conditions.current]
    gains = [Series(f"{i:.3g} A", f, 20.0 * np.log10(np.abs(h))) for i, h in zip(level, by_run, strict=True)]
    colour = {f"{i:.3g} A": k for k, i in enumerate(steps.conditions.current_a)}
    panels = tuple(
        Panel(
            "Gain (dB)",
            [Series(s.label, s.x, s.y, colour=colour[name]) for s in gains if s.label == name],
            title=name,
        )
        for name in colour
    )
    everything = [(f"{i:.3g} A", f, h) for i, h in zip(level, by_run, strict=True)]
    low = steps.lower_order
    fir = fir_response(steps.responses.fir, f, steps.preparation.sample_rate_hz)
    return [
        convergence("Fig. 6.2", steps, level, "every filter has converged"),
        Picture(
            "Fig. 6.3",
            "filters by current",
            "Frequency (Hz)",
            panels,
            "ten filters in each, one for each temperature",
            kind="multiples",
            x_log=True,
        ),
        bode(
            "Fig. 6.4",
            "filters of all runs",
            everything,
            published="very similar, whatever the temperature and current",
            note="Above 20 Hz the low-pass of Sec. 5.1 leaves nothing to learn from.",
        ),
        bode(
            "Fig. 6.5",
            "the average, and filters of low order for it",
            [
                ("FIR, average", f, fir),
                ("IIR, third order", f, low.iir.response(f)),
                ("low-pass, first order", f, low.lowpass.response(f)),
            ],
            published="the IIR filter is excellent, the low-pass misses the phase at high frequency",
        ),
        *(
            bode(
                "Fig. 8.4",
                f"forward, inverse and combined filter, {name}",
                _cascade(forward, inverse),
                published="little phase and change of gain to 20 Hz, rolling off near 1 kHz",
            )
            for name, forward, inverse in (
                ("paper's method", low.iir, steps.inverse_filter),
                ("better method", best.forward_filter, best.inverse_filter),
            )
        ),
    ]


def convergence(place: str, steps: PaperSteps, level: Array, published: str, unit: str = "A") -> Picture:
    """The mean square error of each run's filter over the passes."""
    curves = [
        Series(f"{i:.3g} {unit}", *_thinned(run)) for i, run in zip(level, steps.filters.runs, strict=True)
    ]
    return Picture(
        place,
        "convergence of the adaptive filters",
        "Passes",
        (Panel("Mean square error (N²)", curves, y_log=True),),
        published,
        x_log=True,
    )


def fir_and_iir(place: str, steps: PaperSteps, published: str) -> Picture:
    """The average FIR filter and the third-order one."""
    f = np.geomspace(LOWEST_HZ, HIGHEST * steps.preparation.sample_rate_hz, POINTS)
    fir = fir_response(steps.responses.fir, f, steps.preparation.sample_rate_hz)
    curves = [("FIR, average", f, fir), ("IIR, third order", f, steps.lower_order.iir.response(f))]
    return bode(place, "the FIR filter and its approximation", curves, published=published)


def _cascade(forward: Filter, inverse: Filter) -> list[tuple[str, Array, Complex]]:
    f = np.geomspace(0.5, HIGHEST * forward.sample_rate_hz, POINTS)
    a, b = forward.response(f), inverse.response(f)
    return [("forward", f, a), ("inverse", f, b), ("combined", f, a * b)]


def _responses(steps: PaperSteps) -> tuple[Array, Complex, Complex]:
    """Frequencies up from the motion's, each run's response there, and their mean."""
    rate = steps.preparation.sample_rate_hz
    f = np.geomspace(LOWEST_HZ, HIGHEST * rate, POINTS)
    by_run = np.stack([fir_response(run.lms, f, rate) for run in steps.filters.runs])
    return f, by_run, by_run.mean(axis=0)


def _late_change(passes: NDArray[np.int64], mse: Array) -> float:
    """By how much of itself the error changes over the last passes."""
    late = float(np.interp(LATE * passes[-1], passes, mse))
    return abs(late - float(mse[-1])) / float(mse[-1])


def _thinned(run: AdaptiveFilter) -> tuple[Array, Array]:
    """Passes and errors, as many as a logarithmic axis shows."""
    at = np.unique(np.geomspace(1, run.passes.size, POINTS).round().astype(np.intp)) - 1
    return run.passes[at].astype(np.float64), run.mse_n2[at]
