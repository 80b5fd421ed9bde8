"""The report of a discovery: from the first fit to the last effect that the data bear out."""

from __future__ import annotations

from pathlib import Path

from mrctl.discover.discover import Discovery
from mrctl.discover.reports import report_parts as parts
from mrctl.discover.reports.inputs import inputs_of
from mrctl.measurements.run import Campaign
from mrctl.report.page import Page


def write_discovery(
    result: Discovery, told: parts.Figures, campaign: Campaign, path: Path, command: str = ""
) -> int:
    """Draw the page; returns its size in bytes. Raises InputError where it cannot be written.

    told: the diagnosis as `diagnosis_figures` has it.
    """
    page = Page(
        "What these measurements say",
        f"{len(campaign)} runs",
        command=command,
        inputs=inputs_of(campaign),
    )
    diagnosis, extension = result.diagnosis, result.extension
    records = diagnosis.evidence.full
    parts.how_good(page, diagnosis, told)
    parts.where_it_fails(page, diagnosis.base.fit, records, campaign)
    parts.what_is_missing(page, diagnosis, told)
    if extension.effects:
        parts.what_it_becomes(
            page,
            extension.steps,
            extension.noise_floor_n,
            extension.base,
            extension.fit,
            records,
            campaign,
            extension.held_out,
        )
        page.paragraph(f"Now: **{result.verdict}**. {result.words}")
    parts.what_next(page, told)
    parts.all_looks(page, diagnosis)
    return page.write(path)
