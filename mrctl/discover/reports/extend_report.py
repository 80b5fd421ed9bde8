"""The report of an extension."""

from __future__ import annotations

from pathlib import Path

from mrctl.calibration import Calibration
from mrctl.discover.evidence import Evidence
from mrctl.discover.extend import Extension
from mrctl.discover.reports import report_parts as parts
from mrctl.discover.reports.inputs import inputs_of
from mrctl.measurements.run import Campaign
from mrctl.report.page import Card, Page
from mrctl.report.quantity import format_quantity


def write_extension(
    result: Extension,
    figures: parts.Figures,
    campaign: Campaign,
    calibration: Calibration,
    path: Path,
    command: str = "",
) -> int:
    """Draw the page; returns its size in bytes. Raises InputError where it cannot be written."""
    page = Page(
        "A calibration extended",
        ", ".join(result.effects) or "no effects",
        command=command,
        inputs=inputs_of(campaign, calibration),
    )
    draw_extension(page, result, figures, campaign)
    return page.write(path)


def draw_extension(page: Page, result: Extension, figures: parts.Figures, campaign: Campaign) -> None:
    """The proof, the parameters and the pictures."""
    page.section("The proof", f"Held out, and seen by no fit: {', '.join(result.held_out)}.")
    floor = result.noise_floor_n
    page.key_figures(
        [
            ("Before", format_quantity(result.rmse_before_n, "N"), "held out"),
            ("After", format_quantity(result.rmse_after_n, "N"), "held out"),
            ("Noise", "not known" if floor is None else format_quantity(floor, "N"), "from cycle to cycle"),
        ]
    )
    page.cards(
        [
            Card(
                name,
                "in the calibration",
                "good",
                parts.parameter_values(name, figures["parameters"][name]),
            )
            for name in result.effects
        ]
    )
    records = Evidence.of(campaign).full
    parts.what_it_becomes(
        page, result.steps, floor, result.base, result.fit, records, campaign, result.held_out
    )
