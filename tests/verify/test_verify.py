import json
from pathlib import Path

import numpy as np
import pytest

from mrctl.cli.main import main
from mrctl.identify.baselines import BASELINES
from mrctl.identify.paper.options import PaperOptions
from mrctl.identify.paper.prepare import prepare
from mrctl.measurements import Campaign, write_run_csv
from mrctl.plant.dyno.campaign import Bench
from mrctl.plant.dyno.parameters import MAGNERIDE_LIKE
from mrctl.plant.dyno.sensors import FORCE_NOISE_N
from mrctl.report.series import Panel, Series
from mrctl.verify.entries import Entry, Span
from mrctl.verify.inverse import LOW_PASSED, into_damper
from mrctl.verify.picture import Picture
from mrctl.verify.report import models_side_by_side
from mrctl.verify.signals import signals_of

CHOSEN = {"084", "181"}  # degF: eight of the forty runs
PUBLISHED = {
    *("Fig. 5.11", "Fig. 5.15", "Fig. 5.17", "Fig. 5.18", "Fig. 5.20", "Fig. 6.2", "Fig. 6.3", "Fig. 6.4"),
    *("Fig. 6.5", "Fig. 7.2", "Fig. 7.3", "Fig. 8.4", "Fig. 9.2", "Fig. 9.3", "Fig. 9.4", "Fig. 9.5"),
    *("Fig. 9.6", "Fig. 9.7"),
}


def chosen(item) -> bool:
    return item.run.name.split("_")[1][:3] in CHOSEN


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("paper")
    runs = [item.run for item in Bench(seed=3).runs("paper") if chosen(item)]
    assert len(Campaign(path, tuple(runs), "0" * 64)) == 8
    for run in runs:
        write_run_csv(run, path / f"{run.name}.csv")
    return path


@pytest.fixture(scope="module")
def page(folder, tmp_path_factory) -> tuple[str, dict]:
    """The report and the numbers of the campaign as a user has it, without Spencer's damper."""
    out = tmp_path_factory.mktemp("out")
    options = ["--quick", "--quiet", "-o", str(out / "v.html"), "--json", str(out / "v.json")]
    assert main(["verify", str(folder), *options]) == 0
    return (out / "v.html").read_text(), json.loads((out / "v.json").read_text())


def line(figures, place, *words):
    """The line, as the better method has it: from the force up to its own low-pass."""
    (found,) = [
        e
        for e in figures["entries"]
        if e["place"] == place and all(w in e["what"] for w in words) and not e["what"].endswith(LOW_PASSED)
    ]
    return found


def test_both_methods_stand_side_by_side_with_what_is_asked_of_them(page):
    _, figures = page
    for which in ("on", "off"):
        (plain, low_passed) = [
            e for e in figures["entries"] if e["place"] == "Fig. 9.5" and f", {which}," in e["what"]
        ]
        assert plain["met"] == {"best": True}
        assert low_passed["ours"]["best"] < low_passed["ours"]["paper"]
    assert line(figures, "Fig. 9.7", "found at 2 A")["met"] == {"best": True}
    forward = line(figures, "Fig. 7.3", "forward model, off")
    assert forward["ours"]["best"] < 0.5 * forward["ours"]["paper"]


def test_the_models_of_others_stand_beside_them(page):
    html, figures = page
    for which in ("on", "off"):
        ours = line(figures, "Fig. 7.3", f"forward model, {which}")["ours"]
        assert set(ours) == {"paper", "best", *BASELINES}
        assert all(ours["best"] < ours[name] for name in BASELINES)
    assert set(figures["baselines"]) == set(BASELINES)
    assert figures["baselines"]["Liu"]["parameters"]["exponent"]["unit"] == "1"
    currents = line(figures, "Fig. 9.7", "found at 2 A")["ours"]
    assert set(currents) == {"paper", "best", "Reader", "Liu"}
    assert all(f"Parameters of {name}" in html for name in BASELINES)


def test_every_figure_is_in_the_page_and_its_curves_in_the_json(page):
    html, figures = page
    assert {p["place"] for p in figures["pictures"]} >= PUBLISHED
    for picture in figures["pictures"]:
        assert f"{picture['place']}: " in html
        for curve in (s for panel in picture["panels"] for s in panel["series"]):
            assert len(curve["x"]) == len(curve["y"]) > 1
            assert any(value is not None for value in curve["y"])
    assert "<svg" in html
    assert len(html.encode()) < 3_000_000
    assert not {e["place"] for e in figures["entries"]} & {"Fig. 9.11"}


def test_an_inverse_is_judged_by_what_the_damper_does_with_its_current():
    items = [item for item in Bench(seed=3).runs("paper") if item.run.name.endswith("132F")]
    campaign = Campaign(Path("dyno"), tuple(item.run for item in items), "0" * 64)
    signals = signals_of(campaign, prepare(campaign, PaperOptions()))
    true = [s.current_a for s in signals]
    asked = {"true": true, "too much": [np.minimum(i + 0.3, 3.0) for i in true]}
    percent = into_damper(MAGNERIDE_LIKE, [item.drive for item in items], asked, signals)
    peak = [np.max(np.abs(s.force_n)) for s in signals]
    assert percent["true"] == pytest.approx(100.0 * FORCE_NOISE_N / np.array(peak), rel=0.1)  # noise alone
    assert np.all(percent["too much"][:3] > percent["true"][:3] + 2.0)
    assert percent["too much"][3] == percent["true"][3]


def test_a_model_that_has_no_say_in_a_line_gets_a_dash():
    lines = (
        Entry("x", "y", "%", "-", {"paper": 3.0, "Spencer": 2.0}, short="forward"),
        Entry("x", "z", "%", "-", {"paper": 1.0}, short="inverse"),
        Entry("x", "alone", "%", "-", {"paper": 1.0}),
    )
    headers, rows = models_side_by_side(lines)
    assert headers == ["model", "forward", "inverse"]
    assert [row[0] for row in rows] == ["paper", "Spencer"]
    assert rows[1][2] is None


def test_a_campaign_without_an_off_state_is_refused_in_one_line(folder, tmp_path, capsys):
    for file in folder.glob("[12]A_084F.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    assert main(["verify", str(tmp_path), "--quick", "-o", str(tmp_path / "v.html")]) == 2
    (line,) = [text for text in capsys.readouterr().err.splitlines() if text.startswith("error: ")]
    assert "no run without current" in line
    assert not (tmp_path / "v.html").exists()


def test_a_goal_is_met_inside_its_span_only():
    entry = Entry(
        "x", "y", "%", "-", {"paper": 3.0, "best": 2.5}, {"paper": Span(2.0, 7.0), "best": Span(0.0, 2.0)}
    )
    assert (entry.met("paper"), entry.met("best")) == (True, False)
    assert entry.figures()["met"] == {"paper": True, "best": False}


def test_a_pictures_numbers_are_those_that_it_draws_gaps_included():
    curve = Series("ours", np.array([0.0, 1.0, 2.0]), np.array([1.23456789, np.nan, 3.0]))
    picture = Picture("Fig. 0", "nothing", "x", (Panel("y", [curve]),), "words")
    (panel,) = picture.numbers()["panels"]
    assert panel["series"] == [{"label": "ours", "x": [0.0, 1.0, 2.0], "y": [1.2346, None, 3.0]}]
    assert "Fig. 0: nothing" in picture.figure().html()
    assert picture.caption() == "Published: words."
    assert Picture("Fig. 0", "nothing", "x", (Panel("y", [curve]),), note="Ours.").caption() == "Ours."
