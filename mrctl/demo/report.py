"""The demonstration's report: one HTML page and a table for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrctl.config import Config
from mrctl.demo.bus import BusRun
from mrctl.demo.scenario import DURATION_S, IDEAL, SETTLED_S, STRATEGIES, TEMPERATURES_C, Result, Strategy
from mrctl.plant.closed_loop import reachable
from mrctl.report.bars import Bars, bar_plot
from mrctl.report.page import Page, file_digest
from mrctl.report.plots import loop_plot, panels_plot
from mrctl.report.series import Panel, Series
from mrctl.report.svg import Figure
from mrctl.report.tables import Cell, Value

LINEAR, OURS = STRATEGIES[2], STRATEGIES[-1]
HOT_C = TEMPERATURES_C[-1]
CLOSE_UP_S = (7.9, 9.4)  # around the bump

HEADERS = (
    "",
    "T, °C",
    "force error, N",
    "force error, % of peak",
    "body acceleration, m/s²",
    "tyre load variation, N",
)


class Outcome:
    """The results by strategy and temperature."""

    def __init__(self, results: Sequence[Result]) -> None:
        self._by_case = {(r.strategy, r.temperature_c): r for r in results}

    def of(self, strategy: Strategy, temperature_c: float) -> Result:
        """The result of a case."""
        return self._by_case[strategy, temperature_c]

    def ratio(self, temperature_c: float, *, ideal: bool = False) -> float:
        """Force error of this inverse over that of the linear map."""
        linear, ours = IDEAL if ideal else (LINEAR, OURS)
        errors = [self.of(one, temperature_c).metrics.tracking_rms_n for one in (ours, linear)]
        return errors[0] / errors[1]

    def rows(self, strategies: Sequence[Strategy] = STRATEGIES) -> list[list[Value | Cell]]:
        """One row for each strategy and temperature; passive dampers track nothing."""
        rows: list[list[Value | Cell]] = []
        for temperature_c in TEMPERATURES_C:
            for strategy in strategies:
                m = self.of(strategy, temperature_c).metrics
                tracks = strategy.current_map is not None
                rows.append(
                    [
                        strategy.label + (", ideal coil" if strategy.ideal_coil else ""),
                        f"{temperature_c:g}",
                        m.tracking_rms_n if tracks else None,
                        m.tracking_percent if tracks else None,
                        m.body_acceleration_rms_m_s2,
                        m.tyre_load_variation_rms_n,
                    ]
                )
        return rows

    def findings(self, lag_s: float) -> list[str]:
        """What the figures say, in sentences."""
        hot, ideal = self.ratio(HOT_C), self.ratio(HOT_C, ideal=True)
        lines = [
            f"At {HOT_C:g} °C the inverse model's force error is {hot:.2f} times that of the linear map."
        ]
        if hot > 1.0 / 3.0:
            ours = self.of(OURS, HOT_C).metrics.tracking_rms_n
            without = self.of(IDEAL[1], HOT_C).metrics.tracking_rms_n
            lines.append(
                f"That is more than a third, and the coil's lag of {1000.0 * lag_s:g} ms is why: skyhook's "
                "wish jumps where the damper turns, and the current cannot. With a coil that follows at once "
                f"{without:.0f} N are left of {ours:.0f} N, {ideal:.2f} times the linear map's error."
            )
        return lines


def write_report(outcome: Outcome, bus: BusRun, config: Config, path: Path) -> int:
    """Draw the page; returns its size in bytes."""
    plant = config.plant
    calibrations = sorted({damper.calibration for damper in config.dampers.values()})
    page = Page(
        "mrctl demo",
        "One quarter car, one road, one law; several ways from the wished force to the coil current",
        command="mrctl demo",
        inputs=[(path.name, file_digest(path)) for path in (config.path, *calibrations)],
    )
    page.section(
        "Result",
        f"ISO 8608 class {plant.road_class} at {plant.speed_m_s:g} m/s with a bump of "
        f"{1000.0 * plant.bump_height_m:.0f} mm; law `{config.control.law}`; {config.loop.rate_hz:g} Hz; "
        f"coil lag {1000.0 * plant.coil_lag_s:g} ms; {DURATION_S - SETTLED_S:g} s evaluated. The "
        "controller is the daemon's own tick, fed with CAN frames. Force error: RMS of the force against the "
        "wish, as far as a damper with the same motion, temperature and hysteresis could follow it between "
        "its softest and its firmest.",
    )
    for line in outcome.findings(plant.coil_lag_s):
        page.paragraph(line)
    page.figure(
        force_error_figure(outcome),
        "The same law and road; only the way from force to current differs.",
    )
    page.table(HEADERS, outcome.rows(), "All runs")
    page.section(
        "In time", f"Around the bump, dampers at {HOT_C:g} °C: the force that was wished and could be had."
    )
    page.figure(
        _time_figure(outcome), "The inverse model follows; the linear map gives too much, then too little."
    )
    page.figure(_loop_figure(outcome), "The same runs as force over relative velocity.")
    page.section(
        "What is left",
        "The same runs with a coil whose current follows its command at once: the rest is the model's.",
    )
    page.table(HEADERS, outcome.rows(IDEAL), "With an ideal coil")
    page.section(
        "On the bus",
        "Four dampers on a virtual CAN bus: car and controller exchange frames, protected end to end, and "
        "nothing else. At the end the controller is told to stop.",
    )
    page.key_figures(
        [
            ("frames read", str(bus.frames_to_controller), f"{bus.rejected} refused"),
            ("frames sent", str(bus.frames_from_controller), f"in {bus.seconds:.1f} s"),
            ("last command", f"{bus.rest_a:g} A", "after the ramp"),
        ]
    )
    return page.write(path)


def force_error_figure(outcome: Outcome) -> Figure:
    """Bars of the force error of each way to command, by temperature."""
    mapped = [strategy for strategy in STRATEGIES if strategy.current_map is not None]
    return bar_plot(
        "Force error",
        "RMS, N",
        [f"{T:g} °C" for T in TEMPERATURES_C],
        [Bars(s.label, [outcome.of(s, T).metrics.tracking_rms_n for T in TEMPERATURES_C]) for s in mapped],
    )


def _time_figure(outcome: Outcome) -> Figure:
    panels = []
    for strategy in (LINEAR, OURS):
        record = outcome.of(strategy, HOT_C).record
        part = (record.time_s >= CLOSE_UP_S[0]) & (record.time_s <= CLOSE_UP_S[1])
        time = record.time_s[part]
        panels.append(
            Panel(
                "force, N",
                [
                    Series("wish within reach", time, reachable(record)[part], colour="ink"),
                    Series("force", time, record.force_n[part], colour=0),
                ],
                title=strategy.label,
            )
        )
        panels.append(
            Panel(
                "current, A", [Series("command", time, record.current_command_a[part], colour=1)], height=90
            )
        )
    return panels_plot("Force and current", "time, s", panels)


def _loop_figure(outcome: Outcome) -> Figure:
    series = []
    for strategy, colour in ((LINEAR, 1), (OURS, 0)):
        record = outcome.of(strategy, HOT_C).record
        error = record.force_n - reachable(record)
        keep = np.abs(record.relative_velocity_m_s) < 1.0
        series.append(
            Series(
                strategy.label, record.relative_velocity_m_s[keep], error[keep], style="dots", colour=colour
            )
        )
    return loop_plot(
        "Where the error is", "relative velocity, m/s", "force minus wish, N", series, half=False
    )
