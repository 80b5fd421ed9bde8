"""Colours of reports for both themes, as CSS variables and as ramps for heat maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

Tone: TypeAlias = Literal["ink", "soft", "good", "warn", "bad"]
"""What a colour says; each tone is a class and a CSS variable."""

# Series: the hues of Okabe and Ito's palette, shifted for each theme until every pair stays apart with
# protanopia, deuteranopia and tritanopia too, and each stands out from the page at 3:1 or more (WCAG 1.4.11).
LIGHT = {
    "bg": "#ffffff",
    "sunk": "#f5f6f7",
    "ink": "#16191d",
    "soft": "#565f69",
    "rule": "#c9ced4",
    "grid": "#e7eaed",
    "link": "#0b5394",
    "good": "#0b6e4f",
    "warn": "#8a5a00",
    "bad": "#b3261e",
    "s0": "#0b55cf",
    "s1": "#ec4609",
    "s2": "#229678",
    "s3": "#85428a",
    "s4": "#85380a",
    "s5": "#2c97de",
}
DARK = {
    "bg": "#14171a",
    "sunk": "#1c2024",
    "ink": "#e4e7ea",
    "soft": "#9ca6b0",
    "rule": "#3f474f",
    "grid": "#272c31",
    "link": "#7fb8ee",
    "good": "#4fc79a",
    "warn": "#e0ae4a",
    "bad": "#ff8a80",
    "s0": "#5e9bf3",
    "s1": "#fc812e",
    "s2": "#2d9a92",
    "s3": "#cf9cc0",
    "s4": "#f7c94a",
    "s5": "#b3cbff",
}
SERIES_COLOURS = 6
RAMP_LEVELS = 33
"""Steps of the ramps of heat maps; odd, so that zero has the neutral colour."""

# Anchors of viridis (matplotlib, CC0): lightness rises evenly, so it reads in grey and with colour blindness.
_VIRIDIS = (
    "#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b",
    "#fde725",
)  # fmt: skip
# Blue, neutral, orange: the signed counterpart, even in lightness on both sides; its middle is near the page,
# so it differs by theme.
_DIVERGING = (
    "#1b4f8a", "#3f7fb8", "#82b1d6", "#bcd3e3", "#e9e9e6", "#f0cfae", "#e5a468", "#c8722c", "#8a4608",
)  # fmt: skip
_DIVERGING_DARK = (
    "#9fd3ff", "#5ea6de", "#38719f", "#284a66", "#252a2f", "#5e442c", "#94602c", "#d08a3c", "#ffc374",
)  # fmt: skip

FONT = '"Helvetica Neue",Helvetica,Arial,"Liberation Sans",sans-serif'
MONO = 'ui-monospace,SFMono-Regular,Menlo,Consolas,"Liberation Mono","DejaVu Sans Mono",monospace'


def _channels(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def ramp(anchors: Sequence[str], levels: int = RAMP_LEVELS) -> list[str]:
    """Colours from low to high, evenly between the anchors."""
    channels = [_channels(colour) for colour in anchors]
    colours = []
    for level in range(levels):
        place = level / (levels - 1) * (len(anchors) - 1)
        below = min(int(place), len(anchors) - 2)
        share = place - below
        ends = zip(channels[below], channels[below + 1], strict=True)
        colours.append("#{:02x}{:02x}{:02x}".format(*(round((1 - share) * a + share * b) for a, b in ends)))
    return colours


def ramp_css() -> str:
    """Rules for heat maps: `.q0` to `.q32` viridis, `.v0` to `.v32` signed; text on them black or white."""

    def rules(letter: str, anchors: Sequence[str]) -> str:
        return "".join(
            f".{letter}{i}{{fill:{c}}}.plot .on.{letter}{i}{{fill:{text_on(c)}}}"
            for i, c in enumerate(ramp(anchors))
        )

    dark = f"@media screen and (prefers-color-scheme:dark){{{rules('v', _DIVERGING_DARK)}}}"
    return rules("q", _VIRIDIS) + rules("v", _DIVERGING) + dark


def luminance(colour: str) -> float:
    """Relative luminance of `#rrggbb`, 0 to 1 (WCAG 2)."""
    linear = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for c in (v / 255 for v in _channels(colour))
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    """Contrast ratio of two colours, 1 to 21 (WCAG 2)."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def text_on(fill: str) -> str:
    """Black or white, whichever reads better on `fill`."""
    return max(("#000000", "#ffffff"), key=lambda text: contrast(text, fill))


def variables_css() -> str:
    """The variables for light, and for dark on screens that ask for it; paper is always light."""

    def block(colours: dict[str, str]) -> str:
        return ":root{" + ";".join(f"--{name}:{value}" for name, value in colours.items()) + "}"

    return block(LIGHT) + "@media screen and (prefers-color-scheme:dark){" + block(DARK) + "}"


def figure_css() -> str:
    """Rules for the classes that figures use."""
    series = "".join(f".s{i}{{--c:var(--s{i})}}" for i in range(SERIES_COLOURS))
    tones = "".join(f".{tone}{{--c:var(--{tone})}}" for tone in ("ink", "soft", "good", "warn", "bad"))
    return (
        f"svg.plot{{font:11px {FONT};display:block;width:100%;height:auto;overflow:visible}}"
        ".plot text{fill:var(--ink);stroke:none}.plot .tick{fill:var(--soft)}"
        ".plot .name{font-weight:600;font-size:13px}.plot .sub{font-weight:600;font-size:11.5px}"
        ".plot .mid{text-anchor:middle}.plot .end{text-anchor:end}"
        ".plot .halo{stroke:var(--bg);stroke-width:3px;paint-order:stroke;stroke-linejoin:round}"
        ".grid{stroke:var(--grid);fill:none}.fine{stroke:var(--grid);fill:none;opacity:.6}"
        ".frame{stroke:var(--rule);fill:none}.zero{stroke:var(--soft);opacity:.7;fill:none}"
        + series
        + tones
        + ".line{fill:none;stroke:var(--c);stroke-width:1.4;stroke-linejoin:round;stroke-linecap:round}"
        ".dash{stroke-dasharray:5 3}"
        ".dots{fill:none;stroke:var(--c);stroke-width:3.2;stroke-linecap:round;opacity:.75}"
        ".band{fill:var(--c);opacity:.2;stroke:none}.bar{fill:var(--c);stroke:none}"
        ".rest{fill:var(--c);opacity:.28;stroke:none}"
        ".whisker{stroke:var(--ink);fill:none;stroke-width:1.2}"
        ".mark{stroke:var(--c);fill:none;stroke-width:1.2;stroke-dasharray:4 3}"
        ".hatch{stroke:var(--soft);fill:none;opacity:.55}.cells{shape-rendering:crispEdges}" + ramp_css()
    )
