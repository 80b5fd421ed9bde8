"""The report of a diagnosis."""

from __future__ import annotations

from pathlib import Path

from mrctl.calibration import Calibration
from mrctl.discover.diagnose import Diagnosis
from mrctl.discover.reports import report_parts as parts
from mrctl.discover.reports.inputs import inputs_of
from mrctl.measurements.run import Campaign
from mrctl.report.page import Page


def write_diagnosis(
    result: Diagnosis,
    figures: parts.Figures,
    campaign: Campaign,
    calibration: Calibration,
    path: Path,
    command: str = "",
) -> int:
    """Draw the page; returns its size in bytes. Raises InputError where it cannot be written."""
    page = Page(
        "Which effect is missing",
        f"{len(campaign)} runs",
        command=command,
        inputs=inputs_of(campaign, calibration),
    )
    draw(page, result, figures, campaign)
    return page.write(path)


def draw(page: Page, result: Diagnosis, figures: parts.Figures, campaign: Campaign) -> None:
    """The sections of a diagnosis."""
    records = result.evidence.full
    parts.how_good(page, result, figures)
    parts.where_it_fails(page, result.base.fit, records, campaign)
    parts.what_is_missing(page, result, figures)
    if result.found:
        steps: list[tuple[tuple[str, ...], float]] = [((), figures["rmse_n"])]
        if not any(one.rivals for one in result.found):
            before_last = figures["ranking"][: len(result.found) - 1]
            steps += [((*e["beside"], e["effect"]), e["rmse_n"]) for e in before_last]
        names = tuple(one.trial.effect.name for one in result.found)
        steps.append((names, figures["rmse_after_n"]))
        floor = figures["noise_estimate_n"]
        parts.what_it_becomes(page, steps, floor, result.base.fit, result.final.fit, records, campaign)
    parts.what_next(page, figures)
    parts.all_looks(page, result)
