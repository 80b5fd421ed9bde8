"""The report of a comparison: how good the model is, and where it fails."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrctl.calibration import Calibration
from mrctl.discover.compare import START, Comparison, RunFit
from mrctl.discover.conditions import BY_NAME, VARIABLES, edges_of, mean_map, signal, spectrum
from mrctl.discover.reports.inputs import inputs_of
from mrctl.measurements.run import Campaign
from mrctl.report.heatmap import heat_map
from mrctl.report.page import Page
from mrctl.report.plots import line_plot, loop_plot, panels_plot
from mrctl.report.quantity import format_quantity, unit_text
from mrctl.report.series import Panel, Series

PAIRS = (
    ("velocity_m_s", "displacement_m"),
    ("velocity_m_s", "acceleration_m_s2"),
    ("velocity_m_s", "current_a"),
    ("velocity_m_s", "temperature_c"),
)
SHOWN_S = 3.0
CLOUD = 20_000
FORCE = "Force (N)"
RESIDUAL = "Measured − model (N)"


def write_report(
    result: Comparison, calibration: Calibration, campaign: Campaign, path: Path, command: str = ""
) -> int:
    """Draw the page; returns its size in bytes. Raises InputError where it cannot be written."""
    page = Page(
        "Model against measurements",
        f"{calibration.name}, {len(result.runs)} runs",
        command=command,
        inputs=inputs_of(campaign, calibration),
    )
    _how_good(page, result)
    _where(page, result)
    _pictures(page, result)
    _residual(page, result)
    return page.write(path)


def representative(result: Comparison) -> list[tuple[str, RunFit]]:
    """Best, median and worst run by percent of peak, each once, with what it stands for."""
    order = sorted(result.runs, key=lambda fit: fit.rmse_percent)
    chosen: dict[int, str] = {}
    for at, what in ((len(order) - 1, "worst"), (len(order) // 2, "median"), (0, "best")):
        chosen.setdefault(at, what)
    return [(what, order[at]) for at, what in chosen.items()]


def _how_good(page: Page, result: Comparison) -> None:
    page.section("How good", START)
    known = sum(fit.noise.floor_n is not None for fit in result.runs)
    floor = result.noise_floor_n
    note = (
        f"from cycle to cycle, {known} of {len(result.runs)} runs"
        if known
        else "no run repeats steady cycles"
    )
    page.key_figures(
        [
            ("RMSE", format_quantity(result.rmse_n, "N"), "all samples of all runs"),
            ("Fit", f"{result.fit_percent:.1f} %", "100 (1 − |F − model| / |F − mean F|)"),
            ("Bias", format_quantity(result.bias_n, "N"), "measured less model"),
            ("Noise", "not known" if floor is None else format_quantity(floor, "N"), note),
        ]
    )
    with page.details(f"All {len(result.runs)} runs"):
        page.table(
            ["run", "RMSE N", "% of peak", "fit %", "bias N", "noise N", "at least N", "cycles", "drift N"],
            [
                [
                    fit.run.name,
                    fit.rmse_n,
                    fit.rmse_percent,
                    fit.fit_percent,
                    fit.bias_n,
                    fit.noise.floor_n,
                    fit.noise.lower_bound_n,
                    fit.noise.cycles,
                    fit.noise.drift_n,
                ]
                for fit in result.runs
            ],
        )
        page.paragraph(
            "Noise: what differs between cycles of equal motion. At least: noise from sample to sample, a "
            "lower bound. Drift: slow change between cycles, such as heating; it is no noise."
        )


def _where(page: Page, result: Comparison) -> None:
    page.section(
        "Where it fails",
        "Conditions in which the error is significantly above the average; blocks longer than the residual "
        "remembers count as one sample.",
    )
    if result.worst:
        page.table(
            ["condition", "RMSE N", "bias N"],
            [[c.words[:1].upper() + c.words[1:], c.rmse_n, c.bias_n] for c in result.worst],
            "Worst first",
        )
    else:
        page.paragraph(f"{result.nowhere[:1].upper()}{result.nowhere[1:]}.")
    if result.of_another:
        page.paragraph(
            f"{result.of_another[:1].upper()}{result.of_another[1:]}: another damper's calibration?"
        )
    runs, residuals = [f.run for f in result.runs], [f.residual_n for f in result.runs]
    for x, y in PAIRS:
        found = mean_map(runs, residuals, x, y)
        if found is not None:
            name = f"Mean error by {BY_NAME[x].words} and {BY_NAME[y].words}"
            page.figure(
                heat_map(name, _label(x), _label(y), *found, RESIDUAL, diverging=True),
                "Positive: measured above the model, negative: below. Hatched: too few independent samples.",
            )


def _pictures(page: Page, result: Comparison) -> None:
    chosen = representative(result)
    page.section(
        "Measured and modelled",
        "Shown: " + ", ".join(f"`{fit.run.name}` ({what})" for what, fit in chosen) + ", by % of peak.",
    )
    for what, fit in chosen:
        run = fit.run
        n = min(len(run), round(SHOWN_S * run.sample_rate_hz))
        begin = (len(run) - n) // 2
        part = slice(begin, begin + n)
        time = run.time_s[part]
        page.figure(
            panels_plot(
                f"Force over time, {what} run",
                "Time (s)",
                [
                    Panel(
                        FORCE,
                        [
                            Series("measured", time, run.force_n[part], colour="ink"),
                            Series("model", time, fit.model_n[part], colour=0),
                        ],
                    ),
                    Panel(RESIDUAL, [Series("error", time, fit.residual_n[part], colour=1)], height=110),
                ],
            ),
            f"`{run.name}`: RMSE {fit.rmse_n:.3g} N, {fit.rmse_percent:.2g} % of its peak.",
        )
        loops = []
        for name in ("velocity_m_s", "displacement_m"):
            x = signal(run, name)[part]
            series = [
                Series("measured", x, run.force_n[part], colour="ink"),
                Series("model", x, fit.model_n[part], colour=0),
            ]
            loops.append(
                (loop_plot(f"Force over {BY_NAME[name].words}, {what} run", _label(name), FORCE, series), "")
            )
        page.pair(*loops)


def _residual(page: Page, result: Comparison) -> None:
    page.section(
        "What is left", "The residual of all runs, thinned evenly, against every signal that varies."
    )
    total = sum(fit.residual_n.size for fit in result.runs)
    step = max(1, total // CLOUD)
    residual = np.concatenate([fit.residual_n[::step] for fit in result.runs])
    figures = []
    for variable in VARIABLES:
        values = np.concatenate([signal(fit.run, variable.name)[::step] for fit in result.runs])
        if edges_of(values) is None:
            continue
        cloud = [Series("error", values, residual, style="dots", colour=0)]
        title = f"Error over {variable.words}"
        figures.append((line_plot(title, _label(variable.name), RESIDUAL, cloud, half=True), ""))
    for k in range(0, len(figures), 2):
        page.pair(*figures[k : k + 2])
    series = []
    for what, fit in representative(result):
        f, density = spectrum(fit.residual_n, fit.run.sample_rate_hz)
        keep = (f > 0.0) & (density > 0.0)
        if keep.any():
            series.append(Series(what, f[keep], np.sqrt(density[keep])))
    if series:
        spectra = line_plot("Residual spectrum", "Frequency (Hz)", "N/√Hz", series, x_log=True, y_log=True)
        page.figure(spectra, "White noise is level; what stands out is structure or coloured noise.")
    page.table(
        ["from Hz", "to Hz", "RMS N"],
        [[f"{b.low_hz:g}", b.high_hz, b.rms_n] for b in result.bands],
        "Residual by frequency",
    )


def _label(name: str) -> str:
    variable = BY_NAME[name]
    return f"{variable.words[:1].upper()}{variable.words[1:]} ({unit_text(variable.unit)})"
