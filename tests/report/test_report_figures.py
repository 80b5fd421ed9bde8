from __future__ import annotations

import itertools
import re
import time
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrctl.report import decimate
from mrctl.report.axes import Scale, limits
from mrctl.report.bars import Bars, Reference, bar_plot, waterfall
from mrctl.report.heatmap import heat_map
from mrctl.report.plots import histogram, line_plot, loop_plot, panels_plot, small_multiples
from mrctl.report.series import Mark, Panel, Series, Style
from mrctl.report.svg import Figure
from mrctl.report.theme import DARK, LIGHT, SERIES_COLOURS, contrast, ramp, text_on

SVG = "{http://www.w3.org/2000/svg}"
T = np.linspace(0.0, 10.0, 20_000)


def parsed(figure: Figure) -> list[ET.Element]:
    """Both drawings as trees; anything that is not XML, or not a number, fails here."""
    trees = []
    for drawing in (figure.wide, figure.narrow):
        assert not re.search(
            r"\bnan\b|\binf\b|np\.", re.sub(r"<(title|desc|text).*?</\1>", "", drawing), re.IGNORECASE
        )
        trees.append(ET.fromstring(drawing))  # noqa: S314 (our own output)
    return trees


def texts(tree: ET.Element) -> list[str]:
    return [element.text or "" for element in tree.iter(f"{SVG}text")]


def every_kind(label: str = "Force (N)") -> list[Figure]:
    x, y = [0.0, 1.0, 2.0], [1.0, 4.0, 2.0]
    return [
        line_plot(
            label, label, label, [Series(label, x, y, low=[0, 3, 1], high=[2, 5, 3])], marks=[Mark(1, label)]
        ),
        line_plot(label, label, label, [Series(label, x, y, "dots"), Series("b", x, y, "step")], y_log=True),
        panels_plot(label, label, [Panel(label, [Series(label, x, y)]), Panel(label, [Series("c", x, y)])]),
        loop_plot(label, label, label, [Series(label, [0, 1, 0, -1, 0], [1, 0, -1, 0, 1])]),
        small_multiples(label, label, [Panel(label, [Series(label, x, y)], title=label)] * 5),
        histogram(label, label, [(label, y), ("b", x)]),
        bar_plot(
            label,
            label,
            [label, "b"],
            [Bars(label, [1, 2], [0, 1], [2, 3])],
            references=[Reference(1, label)],
        ),
        waterfall(label, label, [(label, 3.0), ("b", 2.0), ("c", 2.5)], floor=Reference(1.0, label)),
        heat_map(label, label, label, [label, "b"], ["c", label], [[1, 2], [None, 4]], label),
    ]


def test_every_figure_is_xml_and_says_in_words_what_it_shows() -> None:
    for figure in every_kind():
        for tree in parsed(figure):
            assert tree.get("role") == "img"
            assert tree.findtext(f"{SVG}title") == "Force (N)"
            assert len(tree.findtext(f"{SVG}desc") or "") > 20


def test_markup_in_labels_is_shown_and_never_obeyed() -> None:
    evil = '<script>alert("1")</script>&\x00\ud800'
    for figure in every_kind(evil):
        for tree in parsed(figure):
            assert not list(tree.iter(f"{SVG}script"))
            assert any("<script>" in text or "…" in text for text in texts(tree))


def test_the_same_data_gives_the_same_bytes() -> None:
    assert [f.html() for f in every_kind()] == [f.html() for f in every_kind()]


def test_a_standalone_figure_brings_its_own_colours_for_both_themes() -> None:
    alone = every_kind()[0].standalone()
    root = ET.fromstring(alone)  # noqa: S314 (our own output)
    style = root.findtext(f"{SVG}style") or ""
    assert LIGHT["s0"] in style
    assert DARK["s0"] in style
    assert "prefers-color-scheme:dark" in style


@pytest.mark.parametrize("style", ["line", "step", "dots", "filled"])
def test_a_long_noisy_series_stays_small(style: Style) -> None:
    noise = np.random.default_rng(1).normal(0, 1, 1_000_000)
    began = time.perf_counter()
    figure = line_plot("Noise", "Time (s)", "Force (N)", [Series("a", np.arange(noise.size), noise, style)])
    assert time.perf_counter() - began < 10.0
    assert len(figure.html()) < 60_000


def test_eight_long_series_share_one_budget() -> None:
    rng = np.random.default_rng(2)
    series = [Series(f"run {k}", T, rng.normal(k, 1, T.size)) for k in range(8)]
    assert len(line_plot("Runs", "Time (s)", "Force (N)", series).html()) < 110_000


def points(path: str) -> np.ndarray:
    """The absolute points of a path as written by decimate.path."""
    out = []
    for part in path.replace("z", "").split("M")[1:]:
        start, _, steps = part.partition("l")
        begin = np.array(re.findall(r"-?[\d.]+", start.replace("h0", "")), dtype=float)
        moves = np.array(re.findall(r"-?\d*\.?\d+", steps), dtype=float).reshape(-1, 2)
        out.append(begin + np.vstack(([[0, 0]], np.cumsum(moves, axis=0))))
    return np.vstack(out)


def test_a_spike_of_one_sample_in_a_million_is_drawn_at_its_height() -> None:
    y = np.sin(np.linspace(0, 60, 1_000_000))
    y[654_321] = 7.0
    figure = line_plot(
        "Spike", "Time (s)", "Force (N)", [Series("a", np.arange(y.size), y)], y_limits=(-8, 8)
    )
    for tree in parsed(figure):
        line = next(e for e in tree.iter(f"{SVG}path") if "line" in (e.get("class") or ""))
        heights = points(line.get("d") or "")[:, 1]
        scale = (heights.max() - heights.min()) / 8.0  # px per unit: from -1 to 7
        assert heights.min() == pytest.approx(heights.max() - 8 * scale)
        assert np.sort(heights)[1] > heights.min() + 5 * scale


finite = st.floats(min_value=-1e6, max_value=1e6)


@given(st.lists(finite, min_size=1, max_size=3000), st.integers(min_value=1, max_value=40))
def test_thinning_keeps_both_ends_and_both_extremes(values: list[float], bins: int) -> None:
    y = np.array(values)
    x = np.arange(y.size, dtype=float)
    thin_x, thin_y = decimate.extremes(x, y, bins)
    assert (thin_x[0], thin_x[-1]) == (x[0], x[-1])
    assert (thin_y.min(), thin_y.max()) == (y.min(), y.max())
    assert len(thin_x) <= max(4 * bins, 1)


def test_thinning_keeps_the_extremes_of_every_bin() -> None:
    y = np.random.default_rng(3).normal(size=100_000)
    x = np.linspace(0, 1, y.size)
    thin_x, thin_y = decimate.extremes(x, y, 200)
    whole, thin = np.minimum((x * 200).astype(int), 199), np.minimum((thin_x * 200).astype(int), 199)
    for k in range(200):
        assert thin_y[thin == k].max() == y[whole == k].max()
        assert thin_y[thin == k].min() == y[whole == k].min()


def test_a_loop_keeps_its_extremes_in_both_directions() -> None:
    angle = np.linspace(0, 40 * np.pi, 50_000)
    x, y = np.cos(angle), np.sin(angle)
    x[777], y[31_000] = 3.0, -4.0
    thin_x, thin_y = decimate.extremes(x, y, 300)
    assert (thin_x.max(), thin_y.min()) == (3.0, -4.0)
    assert len(thin_x) < 2000


@given(st.lists(st.tuples(finite, finite), min_size=1, max_size=200))
def test_straightening_stays_within_its_tolerance(corners: list[tuple[float, float]]) -> None:
    x, y = np.array(corners).T / 1000
    kept_x, kept_y = decimate.straighten(x, y, 0.5)
    ends = np.stack((kept_x, kept_y), axis=1)
    starts, stops = ends[:-1], ends[1:]
    for point in np.stack((x, y), axis=1) if len(ends) > 1 else ():
        along = stops - starts
        share = np.sum((point - starts) * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-300)
        nearest = starts + np.clip(share, 0, 1)[:, None] * along
        assert np.hypot(*(point - nearest).T).min() <= 0.5 + 1e-6


def test_not_finite_points_break_the_line() -> None:
    y = [1.0, 2.0, float("nan"), 3.0, 2.0, float("inf"), 1.0, 2.0]
    for tree in parsed(line_plot("Gaps", "x", "y", [Series("a", range(8), y)])):
        line = next(e for e in tree.iter(f"{SVG}path") if "line" in (e.get("class") or ""))
        assert (line.get("d") or "").count("M") == 3


def test_none_is_a_gap_too_and_log_axes_leave_out_what_they_cannot_show() -> None:
    for tree in parsed(
        line_plot("Gaps", "x", "y", [Series("a", [1, 2, 3, 4], [1, None, 0, 100])], y_log=True)
    ):
        line = next(e for e in tree.iter(f"{SVG}path") if "line" in (e.get("class") or ""))
        assert (line.get("d") or "").count("M") == 2


def test_a_falling_step_is_upright_however_long_the_series() -> None:
    y = np.where((T > 1) & (T < 7.5), 2.0, 0.0)
    for tree in parsed(line_plot("Current", "Time (s)", "Current (A)", [Series("i", T, y, "step")])):
        line = next(e for e in tree.iter(f"{SVG}path") if "line" in (e.get("class") or ""))
        moves = np.diff(points(line.get("d") or ""), axis=0)
        assert np.all((np.abs(moves) < 0.051).any(axis=1))
        assert len(moves) == 5


wild = st.one_of(
    st.floats(min_value=-1e12, max_value=1e12), st.sampled_from([np.nan, np.inf, -np.inf, 0.0, 1e-12])
)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    data=st.lists(st.tuples(wild, wild), max_size=30),
    style=st.sampled_from(["line", "dots", "step"]),
    x_log=st.booleans(),
    y_log=st.booleans(),
)
def test_no_data_breaks_a_plot(
    data: list[tuple[float, float]], style: Style, *, x_log: bool, y_log: bool
) -> None:
    x, y = [a for a, _ in data], [b for _, b in data]
    parsed(line_plot("Any", "x", "y", [Series("a", x, y, style, low=y, high=y)], x_log=x_log, y_log=y_log))


@settings(max_examples=40, deadline=None)
@given(st.lists(wild, min_size=1, max_size=6))
def test_no_data_breaks_bars_maps_or_histograms(values: list[float]) -> None:
    names = [f"case {k}" for k in range(len(values))]
    for log in (False, True):
        parsed(bar_plot("Any", "x", names, [Bars("a", values), Bars("b", values, values, values)], log=log))
    parsed(waterfall("Any", "x", list(zip(names, values, strict=True))))
    parsed(histogram("Any", "x", [("a", values)]))
    for diverging in (False, True):
        parsed(heat_map("Any", "x", "y", names, ["row"], [values], "v", diverging=diverging))


def test_lengths_that_do_not_match_are_refused() -> None:
    with pytest.raises(ValueError, match="shape"):
        line_plot("t", "x", "y", [Series("a", [1, 2, 3], [1, 2])])
    with pytest.raises(ValueError, match="2 values for 3"):
        bar_plot("t", "v", ["a", "b", "c"], [Bars("s", [1, 2])])
    with pytest.raises(ValueError, match="heat map"):
        heat_map("t", "x", "y", ["a"], ["b"], [[1, 2, 3]], "v")


def test_a_cell_without_a_value_is_hatched_and_a_number_says_its_value() -> None:
    tree = parsed(heat_map("Map", "x", "y", [0, 1, 2], [0, 1], [[3.0, None]], "RMSE (N)"))[0]
    assert sum(e.get("class") == "hatch" for e in tree.iter(f"{SVG}path")) == 1
    assert "3" in texts(tree)
    assert "–" in texts(tree)


def test_bars_are_as_long_as_their_values() -> None:
    tree = parsed(bar_plot("Bars", "RMSE (N)", ["a", "b"], [Bars("s", [10.0, 40.0])]))[0]
    widths = [
        float(e.get("width") or 0)
        for e in tree.iter(f"{SVG}rect")
        if (e.get("class") or "").startswith("bar ")
    ]
    assert widths[1] == pytest.approx(4 * widths[0], rel=0.01)


def test_a_label_keeps_its_colour_from_panel_to_panel() -> None:
    one = Panel("a", [Series("measured", [0, 1], [0, 1], colour="ink"), Series("model", [0, 1], [1, 0])])
    two = Panel("b", [Series("model", [0, 1], [1, 0])])
    tree = parsed(panels_plot("t", "x", [one, two]))[0]
    lines = [e.get("class") for e in tree.iter(f"{SVG}path") if (e.get("class") or "").startswith("line")]
    assert lines[-3:] == ["line ink", "line s0", "line s0"]


@given(
    st.floats(min_value=-1e5, max_value=1e5),
    st.floats(min_value=1e-3, max_value=1e5),
    st.floats(min_value=60, max_value=800),
)
def test_ticks_are_round_lie_inside_and_number_two_or_more(low: float, span: float, length: float) -> None:
    for upright in (False, True):
        ticks = Scale(low, low + span, 0, length).ticks(upright=upright)
        assert len(ticks) >= 2
        assert all(low - 1e-6 * span <= t.value <= low + span * (1 + 1e-6) for t in ticks)


def test_log_ticks_stand_at_decades() -> None:
    labels = [t.label for t in Scale(0.01, 1e7, 0, 800, log=True).ticks() if t.label]
    assert labels == ["0.01", "0.1", "1", "10", "100", "1000", "10000", "10⁵", "10⁶", "10⁷"]


def test_limits_of_nothing_of_one_value_and_of_a_constant_can_be_drawn() -> None:
    for values in ([], [5.0], [0.0, 0.0], [np.nan]):
        for log in (False, True):
            low, high = limits([np.array(values)], log=log)
            assert low < high


def test_colours_stand_out_in_both_themes() -> None:
    for theme in (LIGHT, DARK):
        for name in ("ink", "soft", "link", "good", "warn", "bad"):
            assert contrast(theme[name], theme["bg"]) >= 4.5, name
            assert contrast(theme[name], theme["sunk"]) >= 4.5, name
        for index in range(SERIES_COLOURS):
            assert contrast(theme[f"s{index}"], theme["bg"]) >= 3.0, index


# How colours look with a deficiency, in linear RGB (Machado et al. 2009, severity 1), and how far apart they
# must stay: a distance of 0.02 is just seen.
DEFICIENCIES = {
    "none": ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], 0.10),
    "protanopia": (
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        0.08,
    ),
    "deuteranopia": (
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        0.08,
    ),
    "tritanopia": (
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
        0.06,
    ),
}


def oklab(linear: np.ndarray) -> np.ndarray:
    """Perceptual coordinates (Ottosson 2020); a distance of 0.02 is just seen side by side."""
    to_cones = [[0.41222, 0.53633, 0.05145], [0.21190, 0.68070, 0.10740], [0.08830, 0.28172, 0.62998]]
    to_lab = [[0.21045, 0.79362, -0.00407], [1.97800, -2.42859, 0.45059], [0.02590, 0.78277, -0.80868]]
    lab: np.ndarray = np.array(to_lab) @ np.cbrt(np.array(to_cones) @ linear)
    return lab


@pytest.mark.parametrize("kind", DEFICIENCIES)
@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_every_pair_of_series_differs_for_every_reader(kind: str, theme: dict[str, str]) -> None:
    matrix, apart = DEFICIENCIES[kind]
    seen = {}
    for name in ("ink", *(f"s{i}" for i in range(SERIES_COLOURS))):
        channels = np.array([int(theme[name][i : i + 2], 16) / 255 for i in (1, 3, 5)])
        linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
        seen[name] = oklab(np.clip(np.array(matrix) @ linear, 0, 1))
    for one, other in itertools.combinations(seen, 2):
        assert np.linalg.norm(seen[one] - seen[other]) > apart, (one, other)


def test_the_ramp_rises_evenly_and_text_on_it_can_be_read() -> None:
    colours = ramp(("#440154", "#31688e", "#35b779", "#fde725"))
    assert len(set(colours)) == len(colours)
    assert all(contrast(text_on(colour), colour) >= 4.5 for colour in colours)
