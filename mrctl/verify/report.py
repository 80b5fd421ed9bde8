"""The verification as a page."""

from __future__ import annotations

from pathlib import Path

from mrctl.report.page import Page
from mrctl.report.tables import Cell, Value
from mrctl.verify.entries import METHODS, OWN, Entry
from mrctl.verify.signals import WISH_HZ
from mrctl.verify.tables import Verification

NOTE = (
    "The published measurements are not public. The damper here is a virtual one, outside the model that is "
    "identified, its numbers chosen so that the published method comes to the published errors: that it does "
    "is no independent evidence; what the better method does with the same runs is. The paper's method is "
    "fitted to the force after a low-pass of 20 Hz, held against it and asked for it, as published; all "
    f"others are held against the force as measured, their inverses asked for it up to {WISH_HZ:g} Hz. At "
    "the largest current an inverse can only ask for less: its mean lies below."
)
OTHERS = (
    "Each model is fitted to all runs from several starts; each run counts by its error over its largest "
    "force. Bouc-Wen's and Spencer's model know no temperature and have no inverse; Reader's knows no "
    "temperature either. A dash: the model cannot say."
)
NO_BREAK = "\u00a0"
HEADERS = ["where", "what", *OWN, "published", "asked"]


def rows_of(entries: tuple[Entry, ...]) -> list[list[Value | Cell]]:
    """A row for each line: what both methods reach, what is published, what is asked."""
    rows: list[list[Value | Cell]] = []
    for e in entries:
        row: list[Value | Cell] = [e.place, f"{e.what}, {e.unit}", *(_cell(e, method) for method in OWN)]
        row.append(e.published)
        row.append("; ".join(f"{m} {span}" for m, span in e.goal.items()))
        rows.append(row)
    return rows


def models_side_by_side(entries: tuple[Entry, ...]) -> tuple[list[str], list[list[Value | Cell]]]:
    """Headers, and a row for each model: the lines that the models of others are in."""
    shared = [e for e in entries if e.short]
    rows: list[list[Value | Cell]] = [
        [method, *(_cell(e, method) for e in shared)]
        for method in METHODS
        if any(method in e.ours for e in shared)
    ]
    return ["model", *(e.short for e in shared)], rows


def missed(entries: tuple[Entry, ...]) -> list[str]:
    """Lines that a method does not reach, in words."""
    return [
        f"{e.place} {e.what} ({m}: {e.ours[m]:.3g} {e.unit})" for e in entries for m in e.goal if not e.met(m)
    ]


def write_verification(result: Verification, path: Path, command: str = "") -> int:
    """Draw the page; returns its size in bytes. Raises InputError where it cannot be written."""
    page = Page("The published figures, side by side", f"{len(result.names)} runs", command=command)
    page.section("Side by side", NOTE)
    whole = [[str(row[0]).replace(" ", NO_BREAK), *row[1:]] for row in rows_of(result.entries)]
    page.table(HEADERS, whole, align="llrrll")
    page.section("Models side by side", OTHERS)
    headers, rows = models_side_by_side(result.entries)
    page.table(headers, rows, best=dict.fromkeys(range(1, len(headers)), "min"))
    for fit in result.fits:
        with page.details(f"Parameters of {fit.name}"):
            page.table(
                ["parameter", "value", "unit"],
                [[n, f"{q.value:.5g}", q.unit] for n, q in fit.parameters.items()],
            )
    for chapter in result.chapters:
        page.section(chapter.title)
        for picture in chapter.pictures:
            page.figure(picture.figure(), picture.caption())
    return page.write(path)


def _cell(entry: Entry, method: str) -> Value | Cell:
    """A method's figure; coloured where something is asked of it. Each row has its own unit and digits."""
    value, met = entry.ours.get(method), entry.met(method)
    if value is None:
        return None
    text = f"{value:.3g}"
    return Cell(value, text) if met is None else Cell(value, text, tone="good" if met else "bad")
