"""The verification as a page."""

from __future__ import annotations

from pathlib import Path

from mrctl.report.bars import Bars, bar_plot
from mrctl.report.page import Page
from mrctl.report.tables import Cell, Value
from mrctl.verify.entries import Entry
from mrctl.verify.tables import Verification

METHODS = ("paper", "best")
NOTE = (
    "The published measurements are not public. The damper here is a virtual one, outside the model that is "
    "identified, its numbers chosen so that the published method comes to the published errors: that it does "
    "is no independent evidence; what the better method does with the same runs is. Forwards, the paper's "
    "method is held against the filtered force that it was fitted to, as published, the better one against "
    "the force as measured. At the largest current the inverse can only ask for less: its mean lies below."
)


def rows_of(entries: tuple[Entry, ...]) -> list[list[Value | Cell]]:
    """The table's rows."""
    rows: list[list[Value | Cell]] = []
    for e in entries:
        row: list[Value | Cell] = [e.place, f"{e.what}, {e.unit}", e.published]
        for method in METHODS:
            value, met = e.ours.get(method), e.met(method)
            if value is None or met is None:
                row.append(value)
            else:
                row.append(Cell(value, tone="good" if met else "bad"))
        row.append("; ".join(f"{m} {span}" for m, span in e.goal.items()))
        rows.append(row)
    return rows


def write_verification(result: Verification, path: Path, command: str = "") -> int:
    """Draw the page; returns its size in bytes. Raises InputError where it cannot be written."""
    page = Page("The published figures, side by side", f"{len(result.names)} runs", command=command)
    page.section("Side by side", NOTE)
    page.table(
        ["where", "what", "published", "paper's method", "better method", "asked"], rows_of(result.entries)
    )
    page.section("Run by run")
    for title, label, values in (
        ("Forward model", "RMSE (% of the largest force)", result.forward_percent),
        ("Inverse then forward", "RMSE (% of the largest force)", result.returned_percent),
        ("Mean current found by the inverse", "Current (A)", result.mean_current_a),
    ):
        bars = [Bars(method, values[method]) for method in METHODS]
        page.figure(bar_plot(title, label, list(result.names), bars))
    return page.write(path)
