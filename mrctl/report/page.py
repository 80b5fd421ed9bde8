"""A report page: one HTML file that needs nothing else, no network and no script."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mrctl
from mrctl.errors import InputError
from mrctl.report.style import style_sheet
from mrctl.report.svg import Figure, escape
from mrctl.report.tables import Cell, Value, html_table
from mrctl.report.theme import Tone
from mrctl.whole_file import whole_file

# Nothing may be fetched and nothing run, whatever a file name or a calibration's text smuggles in.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
_SYMBOLS: dict[Tone, str] = {"good": "✓", "warn": "!", "bad": "✗", "ink": "", "soft": ""}


@dataclass(frozen=True, slots=True)
class Card:
    """A verdict or an effect: title, badge (with a tone), an equation, named values, a sentence."""

    title: str
    badge: str = ""
    tone: Tone = "soft"
    values: Sequence[tuple[str, str]] = ()
    equation: str = ""
    text: str = ""


def rich(text: str) -> str:
    """Text escaped, then `code` and **strong** marked up."""
    safe = re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))
    return re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", safe)


def file_digest(path: str | Path) -> str:
    """The first 16 hex figures of a file's SHA-256, for the footer. Raises InputError if unreadable."""
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()[:16]
    except OSError as error:
        raise InputError.at(
            str(path), f"cannot be read ({error.strerror})", "give a readable file"
        ) from error


class Page:
    """Collects blocks in reading order and writes them as one file.

    The same calls give the same bytes: no time stamp, no random ids.
    """

    def __init__(
        self, title: str, subtitle: str = "", *, command: str = "", inputs: Iterable[tuple[str, str]] = ()
    ) -> None:
        """`command` is the command line and `inputs` are (file name, digest), both for the footer."""
        self.title = title
        self.subtitle = subtitle
        self.command = command
        self.inputs = list(inputs)
        self._headings: list[str] = []
        self._blocks: list[str] = []

    def section(self, heading: str, intro: str = "") -> None:
        """Begins a section; it gets a place in the table of contents."""
        if self._headings:
            self._blocks.append("</section>")
        self._headings.append(heading)
        number = len(self._headings)
        self._blocks.append(f'<section id="s{number}"><h2>{escape(heading)}</h2>')
        if intro:
            self.paragraph(intro)

    def paragraph(self, text: str) -> None:
        """A paragraph; `code` and **strong** are marked up, all else is shown as it is."""
        self._blocks.append(f"<p>{rich(text)}</p>")

    def code(self, text: str) -> None:
        """Lines in a fixed pitch: a command, an equation, a piece of YAML."""
        self._blocks.append(f"<pre>{escape(text)}</pre>")

    def table(
        self,
        headers: Sequence[str],
        rows: Sequence[Sequence[Value | Cell]],
        caption: str = "",
        *,
        align: str = "",
        best: dict[int, Literal["min", "max"]] | None = None,
        digits: int = 3,
    ) -> None:
        """A table; numbers are formatted with `digits` figures and stand to the right, None is a dash.

        `align` has a letter l, r or c per column (else by content); `best` marks the smallest or largest
        number of a column. The first column names the row.
        """
        self._blocks.append(html_table(headers, rows, caption, align=align, best=best or {}, digits=digits))

    def figure(self, figure: Figure, caption: str = "") -> None:
        """A figure with what to see in it."""
        self._blocks.append(self._figure(figure, caption))

    def pair(self, *figures: tuple[Figure, str]) -> None:
        """Figures drawn with `half=True` and their captions, side by side; on a phone one below the other."""
        inside = "".join(self._figure(figure, caption) for figure, caption in figures)
        self._blocks.append(f'<div class="pair">{inside}</div>')

    @staticmethod
    def _figure(figure: Figure, caption: str) -> str:
        below = f"<figcaption>{rich(caption)}</figcaption>" if caption else ""
        return f"<figure>{figure.html()}{below}</figure>"

    def key_figures(self, figures: Sequence[tuple[str, str, str]]) -> None:
        """The few numbers that matter most: (label, value with unit, note)."""
        cells = (
            f'<div><dt>{escape(label)}</dt><dd class="value">{escape(value)}</dd>'
            + (f'<dd class="note">{rich(note)}</dd>' if note else "")
            + "</div>"
            for label, value, note in figures
        )
        self._blocks.append(f'<dl class="key">{"".join(cells)}</dl>')

    def cards(self, cards: Sequence[Card]) -> None:
        """Cards side by side, such as the verdict and its effects."""
        self._blocks.append(f'<div class="cards">{"".join(_card(card) for card in cards)}</div>')

    @contextmanager
    def details(self, summary: str) -> Iterator[None]:
        """Folds what is added in `with page.details(...)` away behind the summary; on paper it is open."""
        self._blocks.append(f'<details><summary>{escape(summary)}</summary><div class="inside">')
        yield
        self._blocks.append("</div></details>")

    def html(self) -> str:
        """The whole page."""
        title = escape(self.title)
        subtitle = f'<p class="subtitle">{rich(self.subtitle)}</p>' if self.subtitle else ""
        end = "</section>" if self._headings else ""
        return (
            '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
            '<meta name="viewport" content="width=device-width,initial-scale=1">'
            f'<meta name="generator" content="mrctl {mrctl.__version__}">'
            f'<title>{title}</title><link rel="icon" href="data:,">'
            f"<style>{style_sheet()}</style></head>\n<body>"
            f"<header><h1>{title}</h1>{subtitle}</header>{self._contents()}\n<main>"
            + "\n".join(self._blocks)
            + f"{end}</main>\n{self._footer()}</body></html>\n"
        )

    def write(self, path: str | Path) -> int:
        """Writes the page whole or not at all; returns its bytes. Raises InputError if it cannot."""
        path = Path(path)
        content = self.html().encode()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(path, "wb") as file:
                file.write(content)
        except OSError as error:
            raise _unwritable(path, error) from error
        return len(content)

    def _contents(self) -> str:
        if len(self._headings) < 2:
            return ""
        links = (f'<li><a href="#s{i}">{escape(h)}</a></li>' for i, h in enumerate(self._headings, 1))
        return f'<nav aria-label="Contents"><ol>{"".join(links)}</ol></nav>'

    def _footer(self) -> str:
        lines = [f"mrctl {escape(mrctl.__version__)}"]
        if self.command:
            lines[0] += f" · <code>{escape(self.command)}</code>"
        if self.inputs:
            names = (f"<code>{escape(name)}</code> {escape(digest)}" for name, digest in self.inputs)
            lines.append("Inputs (SHA-256): " + ", ".join(names))
        return "<footer><div>" + "".join(f"<p>{line}</p>" for line in lines) + "</div></footer>"


def _card(card: Card) -> str:
    symbol = f"{_SYMBOLS[card.tone]} " if _SYMBOLS[card.tone] else ""
    badge = f'<span class="badge">{symbol}{escape(card.badge)}</span>' if card.badge else ""
    equation = f"<pre>{escape(card.equation)}</pre>" if card.equation else ""
    pairs = "".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in card.values)
    values = f"<dl>{pairs}</dl>" if pairs else ""
    words = f"<p>{rich(card.text)}</p>" if card.text else ""
    tone = "" if card.tone == "soft" else f" {card.tone}"
    heading = f"<h3><span>{escape(card.title)}</span>{badge}</h3>"
    return f'<div class="card{tone}">{heading}{equation}{values}{words}</div>'


def _unwritable(path: Path, error: OSError) -> InputError:
    return InputError.at(
        str(path), f"cannot be written ({error.strerror})", "choose another place for the report"
    )
