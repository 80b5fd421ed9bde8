"""`mrctl check` as a user meets it: what it prints, its exit status, its JSON."""

from __future__ import annotations

import json

import pytest

from mrctl.cli import main as cli
from mrctl.share_path import share_file

CALIBRATION = share_file("config/calibration.yaml")
VEHICLE = share_file("config/vehicle.yaml")
DBC = share_file("dbc/mrctl.dbc")


def check(capsys, *arguments):
    status = cli.main(["check", *map(str, arguments)])
    out, err = capsys.readouterr()
    return status, out, err


def test_a_sound_calibration_is_ok_with_its_ranges_poles_and_cascade(capsys):
    status, out, err = check(capsys, CALIBRATION)
    assert (status, err) == (0, "")
    assert out.startswith(f"{CALIBRATION}: ok\n")
    for part in ("MagneRide-like damper", "290 N", "2000 N", "28.9 to 82.8 degC", "400 A/s", "0.9900",
                 "0.8740 ± 0.0649j", "within 0.68 dB and 2.8 degrees up to 20 Hz"):  # fmt: skip
        assert part in out


def test_a_sound_configuration_shows_the_worst_case_load_of_the_bus(capsys):
    status, out, _ = check(capsys, VEHICLE)
    assert status == 0
    assert "42.4 % of 500 kbit/s at worst; limit 60 %" in out
    assert "RelativeVelocity  500  270  13.50 %" in out
    assert "front_left, front_right, rear_left, rear_right" in out


def test_a_sound_dbc_shows_its_frames(capsys):
    status, out, _ = check(capsys, DBC)
    assert status == 0
    assert "RelativeVelocity  0x110" in out


def test_errors_go_to_standard_error_one_line_each_with_status_2(capsys, tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text(CALIBRATION.read_text().replace("290.0, 530.0", "530.0, 290.0").replace("400.0", "-4.0"))
    status, out, err = check(capsys, path)
    assert (status, out) == (2, "")
    lines = err.splitlines()
    assert len(lines) == 2
    for line, what in zip(lines, ("`f.force` does not increase", "`limits.current_slew` is -4"), strict=True):
        assert line.startswith(f"error: {path}:")
        assert what in line
        assert "; " in line


def test_good_files_are_told_beside_bad_ones(capsys, tmp_path):
    status, out, err = check(capsys, DBC, tmp_path / "gone.yaml", CALIBRATION)
    assert status == 2
    assert out.count(": ok") == 2
    assert err == f"error: {tmp_path / 'gone.yaml'}: there is no such file; check the path\n"


def test_a_fault_that_two_files_share_is_said_once(capsys, tmp_path):
    text = CALIBRATION.read_text().replace("400.0", "-4.0")
    (tmp_path / "calibration.yaml").write_text(text)
    (tmp_path / "v.yaml").write_text(VEHICLE.read_text().replace("../dbc/mrctl.dbc", str(DBC)))
    status, _, err = check(capsys, tmp_path / "calibration.yaml", tmp_path / "v.yaml")
    assert status == 2
    assert err.count("current_slew") == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "a: 1\n",
            "`schema` is missing; begin with `schema: mrctl/calibration/1` or `schema: mrctl/config/1`",
        ),
        ("schema: foo/1\n", ":1: the schema 'foo/1' is not known"),
        ("schema: 7\n", ":1: the schema 7 is not known"),
        ("dampers: {}\n", "`schema` is missing; begin the file with `schema: mrctl/config/1`"),
        ("f: {}\ng: {}\n", "`schema` is missing; begin the file with `schema: mrctl/calibration/1`"),
        ("schema: mrctl/calibration/3\n", "update mrctl"),
    ],
)
def test_a_file_is_known_by_its_schema_else_by_its_keys(capsys, tmp_path, text, said):
    (tmp_path / "x.yaml").write_text(text)
    status, _, err = check(capsys, tmp_path / "x.yaml")
    assert status == 2
    assert said in err
    assert all(line.startswith("error: ") for line in err.splitlines())


def test_a_dbc_that_is_none_is_an_error_with_its_name(capsys, tmp_path):
    (tmp_path / "x.DBC").write_text("this is no DBC")
    status, _, err = check(capsys, tmp_path / "x.DBC")
    assert status == 2
    assert err.startswith(f"error: {tmp_path / 'x.DBC'}")


def test_warnings_do_not_fail_a_file(capsys, tmp_path):
    text = CALIBRATION.read_text()
    start = text.index("\ninverse_filter:") + 1
    end = text.index("  refine_cutoff")
    (tmp_path / "c.yaml").write_text(
        text[:start]
        + "inverse_filter:\n  sample_rate: {unit: Hz, value: 2000.0}\n  numerator: [0.005]\n"
        + "  denominator: [1.0, -0.995]\n"
        + text[end:]
    )
    status, out, err = check(capsys, tmp_path / "c.yaml")
    assert status == 0
    assert ": ok" in out
    assert err.startswith(f"warning: {tmp_path / 'c.yaml'}:")


def test_json_holds_the_same_findings(capsys, tmp_path):
    bad = tmp_path / "bad.yaml"
    bad.write_text(CALIBRATION.read_text().replace("400.0", "-4.0"))
    status, out, err = check(capsys, CALIBRATION, bad, VEHICLE, DBC, "--json", "-")
    assert (status, err) == (2, "")
    result = json.loads(out)
    assert result["ok"] is False
    good, broken, vehicle, dbc = result["files"]
    assert good["kind"] == "calibration"
    assert good["summary"]["cascade_error"]["gain_db"] == pytest.approx(0.684, abs=0.001)
    assert broken["ok"] is False
    assert broken["errors"][0]["line"] > 90
    assert broken["errors"][0]["mend"] == "it must be greater than 0"
    assert vehicle["summary"]["bus_load"]["total"] < vehicle["summary"]["bus_load"]["limit"]
    assert dbc["summary"]["frames"]["CurrentCommand"]["id"] == 0x100


def test_json_goes_to_a_file_beside_the_text(capsys, tmp_path):
    status, out, _ = check(capsys, CALIBRATION, "--json", tmp_path / "r.json")
    assert status == 0
    assert ": ok" in out
    assert json.loads((tmp_path / "r.json").read_text())["ok"] is True


def test_a_json_path_that_cannot_be_written_is_an_error(capsys, tmp_path):
    status, _, err = check(capsys, CALIBRATION, "--json", tmp_path / "no" / "r.json")
    assert status == 2
    assert "cannot be written" in err


def test_help_shows_an_example(capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["check", "--help"])
    assert ended.value.code == 0
    assert "mrctl check config/vehicle.yaml" in capsys.readouterr().out
