"""The report of an identification: how good, what was found, what the data does not say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.result import Errors
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper
from mrctl.report.page import Page
from mrctl.report.plots import line_plot, loop_plot
from mrctl.report.series import Series
from mrctl.report.svg import Figure

Array = NDArray[np.float64]

INTERVAL = 1.96  # standard deviations to either side of a 95 % interval
SHOWN_RUNS = 2  # worst and best


def write_page(
    path: Path,
    name: str,
    method: str,
    campaign: Campaign,
    damper: Damper,
    std: dict[str, tuple[float, ...]],
    errors: Errors,
    forces: dict[str, Array],
    notes: list[str],
) -> None:
    """Write the page; `forces` has the model's force (n) by run. Raises InputError if unwritable."""
    page = Page(
        f"Identification of {name}",
        f"{len(errors.runs)} runs, method {method}",
        inputs=[(str(campaign.root), campaign.sha256[:16])],
    )
    page.section("How good")
    page.key_figures(
        [
            ("RMSE", f"{errors.rmse_n:.3g} N", "pooled over all runs"),
            ("Fit", f"{errors.fit_percent:.1f} %", "NRMSE"),
            *(
                (label, f"{value:.2f} %", "of each run's peak force, mean")
                for label, value in (("On", errors.rmse_percent_on), ("Off", errors.rmse_percent_off))
                if value is not None
            ),
        ]
    )
    ranked = sorted(errors.runs, key=lambda row: -row.rmse_percent)
    shown = ranked if len(ranked) < SHOWN_RUNS else [ranked[0], ranked[-1]]
    by_name = {run.name: run for run in campaign.runs}
    for row in shown:
        run, force = by_name[row.file], forces[row.file]
        measured = Series("measured", run.velocity_m_s, run.force_n, style="dots")
        modelled = Series("model", run.velocity_m_s, force)
        page.figure(
            loop_plot(
                f"Force over velocity, {row.file}", "velocity (m/s)", "force (N)", [measured, modelled]
            ),
            f"{row.file}: {row.rmse_percent:.2f} % of its peak.",
        )
    page.table(
        ["run", "A", "degC", "RMSE N", "% of peak", "fit %"],
        [
            [r.file, r.current_a, r.temperature_c, r.rmse_n, r.rmse_percent, r.fit_percent]
            for r in errors.runs
        ],
    )
    page.section("What was found", "Bands are 95 % intervals.")
    for figure in _tables(damper, std):
        page.figure(figure)
    hz = np.geomspace(0.1, 0.45 * damper.forward_filter.sample_rate_hz, 200)
    h, inverse = damper.forward_filter.response(hz), damper.inverse_filter.response(hz)
    page.figure(
        line_plot(
            "Hysteresis filter",
            "frequency (Hz)",
            "gain (dB)",
            [
                Series(label, hz, 20 * np.log10(np.maximum(np.abs(x), 1e-6)))
                for label, x in (("forward", h), ("inverse", inverse), ("both", h * inverse))
            ],
            x_log=True,
        )
    )
    if notes:
        page.section("What this campaign does not say")
        for note in notes:
            page.paragraph(note)
    page.write(path)


def _tables(damper: Damper, std: dict[str, tuple[float, ...]]) -> list[Figure]:
    t = damper.static

    def series(label: str, key: str, x: Array, y: Array) -> Series:
        wide = INTERVAL * np.asarray(std[key]) if key in std else None
        if wide is None:
            return Series(label, x, y)
        return Series(label, x, y, low=y - wide, high=y + wide)

    i, v, temperature = (np.asarray(x) for x in (t.current_a, t.velocity_m_s, t.temperature_c))
    return [
        line_plot("f", "current (A)", "force (N)", [series("f", "f.force", i, np.asarray(t.force_n))]),
        line_plot("g", "velocity (m/s)", "shape (1)", [series("g", "g.shape", v, np.asarray(t.shape))]),
        line_plot(
            "h",
            "temperature (degC)",
            "force ratio (1)",
            [
                series("off", "h.off", temperature, np.asarray(t.h_off)),
                series("on", "h.on", temperature, np.asarray(t.h_on)),
            ],
        ),
    ]
