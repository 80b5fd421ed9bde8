"""The report of a replay: signals, states, what was rejected, currents and the forces that they make."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from mrctl.can.frames import State
from mrctl.config import Config
from mrctl.replay.run import Options, Result, replay
from mrctl.replay.trace import Trace
from mrctl.report.page import Page, file_digest
from mrctl.report.plots import line_plot, panels_plot
from mrctl.report.series import Panel, Series
from mrctl.report.svg import Figure

CHANGES_SHOWN = 40
TIME = "Time since the start (s)"


def reported(
    path: Path,
    config: Config,
    options: Options,
    report: Path,
    *,
    out: Path | None = None,
    command: str = "",
    progress: Callable[[float], None] = lambda _: None,
) -> Result:
    """Replay one log as `replay` does, and draw the report. Raises InputError as `replay`."""
    trace = Trace(config)
    result = replay(path, config, options, out=out, observer=trace, progress=progress)
    trace.flush()
    files = (path, config.path, *sorted({damper.calibration for damper in config.dampers.values()}))
    page = Page(
        "Replay",
        f"`{path.name}` through the controller of `{config.path.name}`",
        command=command,
        inputs=[(file.name, file_digest(file)) for file in files],
    )
    figures = result.figures
    _what_happened(page, figures)
    page.section(
        "Dampers",
        "Force: what the model makes of the commanded current, without the coil's lag. A signal that is not "
        "used is not drawn. "
        + ", ".join(f"{state.value} is {state.name}" for state in State)
        + (f". Extremes of {trace.ticks_per_bucket} ticks each." if trace.ticks_per_bucket > 1 else "."),
    )
    for index, name in enumerate(trace.dampers):
        page.figure(_damper(trace, index, name, figures["start_s"]))
    _rejected(page, trace, figures)
    page.write(report)
    return result


def _what_happened(page: Page, figures: dict[str, Any]) -> None:
    compared = figures["compared"]
    page.section("What happened")
    page.key_figures(
        [
            ("Time", f"{figures['seconds']:.4g} s", f"{figures['ticks']} ticks, clock: {figures['clock']}"),
            ("Frames", str(figures["frames"]), f"{figures['traffic']['read']} read by the controller"),
            ("Rejected", str(sum(figures["rejected"].values())), "frames, values and lines"),
            (
                "Commands",
                str(figures["commands"]),
                f"{compared['commands']} compared with recorded ones, {figures['differences']} differ"
                if compared["commands"]
                else "none recorded to compare with",
            ),
        ]
    )
    if figures["differences"]:
        page.paragraph(
            f"Largest difference **{compared['largest_difference_a']:.4g} A**, the first at "
            f"{compared['first_difference_s']:.4g} s."
        )
    for note in figures["notes"]:
        page.paragraph(f"{note[:1].upper()}{note[1:]}.")
    states = [state.name for state in State]
    page.table(
        ["damper", *states],
        [[name, *(spent.get(state) for state in states)] for name, spent in figures["states_s"].items()],
        "Seconds in each state",
    )
    changes = figures["changes"]
    if changes:
        with page.details(f"{figures['state_changes']} changes of state"):
            page.table(
                ["s", "damper", "from", "to", "why"],
                [
                    [f"{c['time_s']:.3f}", c["damper"], c["before"], c["after"], c["cause"]]
                    for c in changes[:CHANGES_SHOWN]
                ],
                f"The first {min(CHANGES_SHOWN, len(changes))}",
            )


def _damper(trace: Trace, index: int, name: str, begin_s: float) -> Figure:
    def series(label: str, signal: str, colour: int | None = None, style: Any = "line") -> Series:  # noqa: ANN401
        return Series(label, *trace.line(index, signal, begin_s), colour=colour, style=style)

    panels = [
        Panel(
            "Velocity (m/s)",
            [series("relative", "relative_velocity_m_s", 0), series("body", "body_velocity_m_s", 1)],
            height=140,
        ),
        Panel(
            "Force (N)", [series("wish", "force_wish_n", 2), series("model", "force_model_n", 3)], height=140
        ),
        Panel("Current (A)", [series("command", "current_a", 4)], height=110),
        Panel("State", [series("state", "state", 5, "step")], y_limits=(-0.2, 4.2), height=70),
        Panel("Case (°C)", [series("case", "temperature_c", 1)], height=70),
    ]
    return panels_plot(name, TIME, panels)


def _rejected(page: Page, trace: Trace, figures: dict[str, Any]) -> None:
    page.section("Rejected", "What was never taken for data, by reason.")
    rejected = figures["rejected"]
    if not rejected:
        page.paragraph("Nothing.")
        return
    page.table(["reason", "count"], [[reason, count] for reason, count in rejected.items()])
    time, count = trace.rejected(figures["start_s"])
    page.figure(
        line_plot(
            "Rejected by the controller",
            TIME,
            "Frames and values",
            [Series("rejected", time, count, style="step", colour=1)],
        ),
        "Counted from the start; lines and frames that a live port would not have handed on are not in it.",
    )
