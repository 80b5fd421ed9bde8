"""SVG text: elements, escaping, text widths, paths, and the Figure that a page takes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from mrctl.report.theme import figure_css, variables_css

WIDE = 840.0
"""Width in px that a figure is drawn for on a desk screen and on paper."""
HALF = 408.0
"""Width in px of a figure that stands beside another."""
NARROW = 344.0
"""Width in px that the same figure is drawn for again on a phone, so that its text stays readable there."""

_ILLEGAL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")

# Advance widths in thousandths of the font size: the wider of Helvetica's (and Arial's) and DejaVu's.
_WIDTHS = {
    **dict.fromkeys("'ijl", 280),
    **dict.fromkeys("I", 300),
    **dict.fromkeys(" ,.·", 320),
    **dict.fromkeys("/:;|", 340),
    **dict.fromkeys("f", 360),
    **dict.fromkeys("-", 380),
    **dict.fromkeys("()[]t", 400),
    **dict.fromkeys("!r²³", 420),
    **dict.fromkeys("*°", 500),
    **dict.fromkeys("J", 520),
    **dict.fromkeys("sz", 540),
    **dict.fromkeys("c", 560),
    **dict.fromkeys("k", 580),
    **dict.fromkeys("vxy", 600),
    **dict.fromkeys('"?FLT\\_`aeo–', 620),
    **dict.fromkeys("ABEKPSVXYZ", 700),
    **dict.fromkeys("CHNRU", 760),
    **dict.fromkeys("&D", 780),
    **dict.fromkeys("GOQw", 820),
    **dict.fromkeys("#+<=>^~−×±→", 840),
    **dict.fromkeys("M", 880),
    **dict.fromkeys("m", 980),
    **dict.fromkeys("%@W…", 1000),
}
_OTHER_WIDTH = 640


def escape(text: object) -> str:
    """Text made safe for HTML and XML, content and quoted attributes; what XML forbids becomes U+FFFD."""
    clean = _ILLEGAL.sub("\ufffd", str(text))
    return clean.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")


def number(value: float) -> str:
    """A coordinate in px to a tenth, as short as it gets."""
    short = f"{value:.1f}".removesuffix(".0")
    return "0" if short == "-0" else short


def element(name: str, content: str | Iterable[str] = "", /, **attributes: str | float) -> str:
    """One element; `class_` is written class and `stroke_width` stroke-width; content is already SVG."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{value if isinstance(value, str) else number(value)}"'
        for key, value in attributes.items()
    )
    inside = content if isinstance(content, str) else "".join(content)
    return f"<{name}{written}>{inside}</{name}>" if inside else f"<{name}{written}/>"


def text(x: float, y: float, words: str, class_: str = "", **attributes: str | float) -> str:
    """A text element with its words escaped."""
    extra = {"class_": class_} if class_ else {}
    return element("text", escape(words), x=x, y=y, **extra, **attributes)


def text_width(words: str, size: float = 11.0) -> float:
    """Width of text in px, in the widest of the usual fonts."""
    return sum(_WIDTHS.get(letter, _OTHER_WIDTH) for letter in words) * size / 1000


def wrap(words: str, width: float, size: float) -> list[str]:
    """Text cut at spaces into lines of at most `width` px; a longer single word stands alone."""
    lines: list[str] = []
    for word in words.split():
        if lines and text_width(f"{lines[-1]} {word}", size) <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


def shorten(words: str, width: float, size: float = 11.0) -> str:
    """Text cut with an ellipsis in its middle to fit `width` px; both ends of a file name tell most."""
    if text_width(words, size) <= width:
        return words
    for keep in range(len(words) - 1, 1, -1):
        head = (keep + 1) // 2
        cut = f"{words[:head]}…{words[len(words) - (keep - head) :]}"
        if text_width(cut, size) <= width:
            return cut
    return "…"


@dataclass(frozen=True, slots=True)
class Figure:
    """A finished figure: the same data drawn for a desk screen and for a phone."""

    title: str
    description: str
    wide: str
    narrow: str
    half: bool = False

    def html(self) -> str:
        """Both drawings; the page's style shows the one that fits the screen."""
        return f'<div class="wide">{self.wide}</div><div class="narrow">{self.narrow}</div>'

    def standalone(self) -> str:
        """An SVG file of its own that follows the viewer's theme, for a README or a paper."""
        style = f"<style>{variables_css()}{figure_css()}svg.plot{{background:var(--bg)}}</style>"
        head, _, rest = self.wide.partition(">")
        return f"{head}>{style}{rest}\n"

    def __str__(self) -> str:
        """The SVG for a desk screen."""
        return self.wide


def figure(
    title: str, description: str, draw: Callable[[float], tuple[list[str], float]], *, half: bool = False
) -> Figure:
    """Draws a figure for each screen; `draw` takes the width and returns the content and its height."""

    def drawn(width: float) -> str:
        lines = wrap(title, width - 4, 13.5)
        top = 17.0 * len(lines) + 3 if lines else 0.0
        content, height = draw(width)
        head = [text(0, 13 + 17 * i, line, "name") for i, line in enumerate(lines)]
        body = element("g", content, transform=f"translate(0 {number(top)})")
        return element(
            "svg",
            [element("title", escape(title)), element("desc", escape(description)), *head, body],
            xmlns="http://www.w3.org/2000/svg",
            class_="plot",
            role="img",
            viewBox=f"0 0 {number(width)} {number(top + height)}",
        )

    return Figure(title, description, drawn(HALF if half else WIDE), drawn(NARROW), half)
