import json
from pathlib import Path

import pytest

from mrctl.cli.main import main
from mrctl.measurements import Campaign, write_run_csv
from mrctl.plant.dyno.campaign import Bench
from mrctl.verify.entries import Entry, Span


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Path:
    """Twelve of the forty runs."""
    folder = tmp_path_factory.mktemp("paper")
    runs = [
        item.run
        for item in Bench(seed=3).runs("paper")
        if item.run.name.split("_")[1][:3] in {"084", "132", "181"}
    ]
    assert len(Campaign(folder, tuple(runs), "0" * 64)) == 12
    for run in runs:
        write_run_csv(run, folder / f"{run.name}.csv")
    return folder


def test_both_methods_stand_side_by_side_with_what_is_asked_of_them(campaign, tmp_path, capsys):
    page = tmp_path / "verify.html"
    assert main(["verify", str(campaign), "-o", str(page), "--json", "-"]) == 0
    entries = json.loads(capsys.readouterr().out)["entries"]
    by_what = {(e["place"], e["what"].split(",")[1].strip() if "," in e["what"] else ""): e for e in entries}
    on, off = by_what["Fig. 9.5", "on"], by_what["Fig. 9.5", "off"]
    assert on["ours"]["best"] < on["ours"]["paper"]
    assert off["ours"]["best"] < off["ours"]["paper"]
    assert on["met"] == {"best": True}
    forward = by_what["Fig. 7.2", "off"]
    assert forward["ours"]["best"] < 0.5 * forward["ours"]["paper"]
    assert "<svg" in page.read_text()


def test_a_goal_is_met_inside_its_span_only():
    entry = Entry(
        "x", "y", "%", "-", {"paper": 3.0, "best": 2.5}, {"paper": Span(2.0, 7.0), "best": Span(0.0, 2.0)}
    )
    assert (entry.met("paper"), entry.met("best")) == (True, False)
    assert entry.figures()["met"] == {"paper": True, "best": False}
