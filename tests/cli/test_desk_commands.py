import json

import numpy as np
import pytest
from discover.hidden import NOISE_N, among, few, rich

from mrctl.calibration import load_calibration
from mrctl.cli.main import main
from mrctl.measurements import write_run_csv

SPRING = {"gas_spring": {"preload_n": 80.0, "stiffness_n_m": 4000.0, "progression_per_m": 2.0}}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    for run in few(rich(SPRING)).runs:
        if not run.name.startswith(("0.5Hz_0.5A", "0.5Hz_3A", "5Hz_0.5A", "5Hz_3A")):
            write_run_csv(run, folder / f"{run.name}.csv")
    return folder


@pytest.fixture(scope="module")
def identified(campaign, tmp_path_factory):
    place = tmp_path_factory.mktemp("identified")
    calibration, figures = place / "damper.yaml", place / "identify.json"
    arguments = ["identify", str(campaign), "-o", str(calibration), "--json", str(figures), "--quiet"]
    assert main(arguments) == 0
    return calibration, json.loads(figures.read_text())


def _json(capsys, *arguments):
    assert main([str(a) for a in arguments] + ["--json", "-"]) == 0
    return json.loads(capsys.readouterr().out)


def test_identify_says_how_good_it_is_and_what_it_could_not_learn(identified, campaign):
    calibration, figures = identified
    assert {"runs", "rmse_n", "fit_percent", "rmse_percent_on", "rmse_percent_off"} <= set(figures)
    assert len(figures["runs"]) == len(list(campaign.iterdir()))
    assert figures["rmse_n"] > 20.0  # the spring is not in it
    loaded = load_calibration(calibration)
    assert loaded.provenance.data_sha256
    assert loaded.provenance.history[0].what == "identify"


def test_what_identify_wrote_is_sound_and_predicts(identified, campaign, tmp_path):
    calibration, figures = identified
    assert main(["check", str(calibration)]) == 0
    run = min(campaign.iterdir())
    assert main(["predict", str(calibration), str(run), "-o", str(tmp_path / "out.csv")]) == 0
    table = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True)
    rmse = float(np.sqrt(np.mean((table["force_N"] - table["force_model_N"]) ** 2)))
    own = next(r for r in figures["runs"] if r["file"].removesuffix(".csv") == run.stem)
    assert rmse == pytest.approx(own["rmse_n"], rel=0.05)


def test_a_slow_run_is_predicted_as_it_is_compared(identified, campaign, tmp_path, capsys):
    """At 100 Hz no filter can follow: both go through the model at its own rate."""
    calibration, _ = identified
    table = np.genfromtxt(min(campaign.glob("5Hz*.csv")), delimiter=",", names=True)[::5]
    slow, out = tmp_path / "slow" / "run.csv", tmp_path / "out.csv"
    slow.parent.mkdir()
    np.savetxt(slow, table, delimiter=",", header=",".join(table.dtype.names), comments="")
    assert main(["predict", str(calibration), str(slow), "-o", str(out), "--quiet"]) == 0
    made = np.genfromtxt(out, delimiter=",", names=True)
    rmse = float(np.sqrt(np.mean((made["force_N"] - made["force_model_N"]) ** 2)))
    assert rmse == pytest.approx(_json(capsys, "compare", calibration, slow)["rmse_n"], rel=1e-6)


@pytest.fixture(scope="module")
def extended(identified, campaign, tmp_path_factory):
    """The calibration with the spring, what was said of it, and its report."""
    place = tmp_path_factory.mktemp("extended")
    longer, page, figures = place / "extended.yaml", place / "extended.html", place / "extended.json"
    arguments = ["extend", identified[0], campaign, "--effect", "gas_spring", "-o", longer, "--report", page]
    assert main([*map(str, arguments), "--json", str(figures), "--quiet"]) == 0
    return longer, json.loads(figures.read_text()), page


def test_diagnose_extend_and_compare_lead_from_the_gap_to_the_noise(
    identified, campaign, extended, tmp_path, capsys, monkeypatch
):
    calibration, _ = identified
    report = tmp_path / "diagnosis.html"
    among(monkeypatch, "gas_spring", "fluid_inertia", "coulomb_friction", "end_stop", "viscous_damping")
    found = _json(capsys, "diagnose", calibration, campaign, "--report", report)
    assert (found["verdict"], found["effects"]) == ("found", ["gas_spring"])
    assert found["next_run"] is None
    assert found["ranking"][0]["parameters"]["stiffness_n_m"]["unit"] == "N/m"
    assert report.stat().st_size < 3_000_000
    longer, said, page = extended
    assert said["effects"] == ["gas_spring"]
    assert said["rmse_after_n"] < 6.0 < said["rmse_before_n"]
    assert said["held_out"]
    assert page.stat().st_size < 3_000_000
    history = load_calibration(longer).provenance.history
    assert [step.effects for step in history][-1] == ("gas_spring",)
    assert _json(capsys, "compare", longer, campaign)["rmse_n"] < 6.0


@pytest.mark.long
def test_of_a_model_that_has_the_effect_nothing_is_missing(campaign, extended, capsys, monkeypatch):
    among(monkeypatch, "gas_spring", "fluid_inertia", "coulomb_friction", "end_stop", "viscous_damping")
    again = _json(capsys, "diagnose", extended[0], campaign)
    assert (again["verdict"], again["effects"]) == ("none", [])


@pytest.mark.long
def test_an_effect_is_taken_out_again(campaign, extended, tmp_path, capsys):
    longer, plain = extended[0], tmp_path / "plain.yaml"
    removed = _json(capsys, "extend", longer, campaign, "--remove", "gas_spring", "-o", plain)
    assert removed["effects"] == []
    assert [step["effects"] for step in removed["steps"]] == [["gas_spring"], []]
    assert removed["rmse_before_n"] < 6.0 < removed["rmse_after_n"]


def test_an_effect_is_not_added_and_taken_out_at_once(campaign, extended, tmp_path, capsys):
    both = ["--effect", "gas_spring", "--remove", "gas_spring", "-o", str(tmp_path / "plain.yaml")]
    assert main(["extend", str(extended[0]), str(campaign), *both, "--quiet"]) == 2
    assert capsys.readouterr().err.startswith("error: --remove: gas_spring is to be added as well")


def test_discover_goes_the_whole_way(campaign, tmp_path, capsys, monkeypatch):
    among(monkeypatch, "gas_spring", "fluid_inertia", "viscous_damping", "mount_compliance", "force_offset")
    calibration, page = tmp_path / "found.yaml", tmp_path / "found.html"
    found = _json(capsys, "discover", campaign, "-o", calibration, "--report", page)
    assert [step["effects"] for step in found["history"]] == [[], ["gas_spring"]]
    assert found["history"][1]["rmse_n"] < 1.1 * NOISE_N < 0.5 * found["history"][0]["rmse_n"]
    assert found["held_out"]
    assert (found["verdict"], found["effects"]) == ("none", ["gas_spring"])
    assert [e.name for e in load_calibration(calibration).damper.effects] == ["gas_spring"]
    assert page.stat().st_size < 3_000_000


@pytest.mark.parametrize("command", ["identify", "discover"])
def test_a_folder_without_measurements_is_one_line_and_status_2(command, tmp_path, capsys):
    assert main([command, str(tmp_path), "-o", str(tmp_path / "x.yaml"), "--quiet"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("error: ")
    assert not (tmp_path / "x.yaml").exists()


def test_an_effect_that_does_not_exist_is_one_line_that_lists_those_that_do(identified, campaign, capsys):
    arguments = [
        "extend",
        str(identified[0]),
        str(campaign),
        "--effect",
        "gravity",
        "-o",
        "x.yaml",
        "--quiet",
    ]
    assert main(arguments) == 2
    assert "gas_spring" in capsys.readouterr().err
