from __future__ import annotations

import subprocess
import time

import numpy as np
import pytest
from motions import HEADER, csv_text, rows, sine, write_csv

from mrctl.errors import InputError
from mrctl.measurements import load_campaign, load_run, write_run_csv


def complaint(path, **needs) -> str:
    with pytest.raises(InputError) as caught:
        load_campaign(path, **needs)
    return str(caught.value)


def test_a_folder_is_read_in_the_order_of_its_paths_with_differing_rates(tmp_path):
    for name, rate in (("b/two.csv", 500), ("a.csv", 1000), ("b/c/three.csv", 2000), ("z.CSV", 200)):
        write_csv(tmp_path / name, rows(sine(rate=rate)))
    (tmp_path / "notes.txt").write_text("not data")
    campaign = load_campaign(tmp_path)
    assert [run.name for run in campaign.runs] == ["a.csv", "b/c/three.csv", "b/two.csv", "z.CSV"]
    assert [round(run.sample_rate_hz) for run in campaign.runs] == [1000, 2000, 500, 200]
    assert campaign.warnings == ()


def test_all_channels_arrive_in_their_arrays(tmp_path):
    table = rows()
    run = load_run(write_csv(tmp_path / "r.csv", table))
    for index, name in enumerate(("time_s", "velocity_m_s", "current_a", "temperature_c", "force_n")):
        assert np.allclose(getattr(run, name), table[:, index], rtol=1e-8)
    assert run.derived == ("displacement_m", "acceleration_m_s2")
    assert run.row(0) == 2
    assert any("displacement derived" in note for note in run.notes)


def test_the_hash_is_that_of_the_files_as_sha256sum_prints_it(tmp_path):
    write_csv(tmp_path / "a.csv")
    write_csv(tmp_path / "b" / "c.csv")
    listing = subprocess.run(
        ["sh", "-c", "sha256sum a.csv b/c.csv | sha256sum"],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert load_campaign(tmp_path).sha256 == listing.stdout.split()[0]


def test_optional_channels_are_kept_as_measured(tmp_path):
    motion = sine()
    table = np.column_stack((rows(motion), motion.x, motion.a, np.full(len(motion.x), 0.9)))
    header = HEADER + ",displacement_m,acceleration_m_s2,current_command_A"
    run = load_run(write_csv(tmp_path / "r.csv", table, header=header))
    assert run.derived == ()
    assert np.allclose(run.displacement_m, motion.x, rtol=1e-8, atol=1e-11)
    assert run.current_command_a is not None
    assert run.fluid_temperature_c is None


@pytest.mark.parametrize("given", ["displacement_m", "acceleration_m_s2"])
def test_velocity_is_derived_where_it_is_missing(tmp_path, given):
    motion = sine()
    table = rows(motion)
    table[:, 1] = motion.x if given == "displacement_m" else motion.a
    run = load_run(write_csv(tmp_path / "r.csv", table, header=HEADER.replace("velocity_m_s", given)))
    assert "velocity_m_s" in run.derived
    assert np.std(run.velocity_m_s - motion.v) < 0.01 * np.std(motion.v)


def test_force_and_current_may_be_missing_where_nobody_needs_them(tmp_path):
    table = rows()[:, :4]
    path = write_csv(tmp_path / "r.csv", table, header=HEADER.replace(",force_N", ""))
    assert "force_N" in complaint(path)
    run = load_run(path, need_force=False)
    assert not run.has_force
    assert run.has_current
    assert np.isnan(run.force_n).all()


@pytest.mark.parametrize(
    ("encode", "said"),
    [
        (lambda text: text.encode("utf-8-sig"), None),
        (lambda text: text.encode("utf-16"), "utf-16"),
        (lambda text: text.encode("utf-16-le"), "utf-16-le"),
        (lambda text: ("# Prüfstand 5°\n" + text).encode("latin-1"), "latin-1"),
        (lambda text: text.replace("\n", "\r\n").encode(), None),
        (lambda text: text.replace("\n", "\r").encode(), None),
        (lambda text: text.replace(",", ";").replace(".", ",").encode(), "decimal commas"),
        (lambda text: text.replace(",", "\t").encode(), "tab"),
        (lambda text: text.replace(",", ";").encode(), "semicolon"),
        (lambda text: (text + "\n\n  \n").encode(), None),
        (lambda text: ("# a comment\n\n" + text.replace("\n", "\n# again\n", 3)).encode(), None),
        (lambda text: ('"' + text.strip().replace(",", '","').replace("\n", '"\n"') + '"').encode(), None),
        (lambda text: text.replace(",", " , ").encode(), None),
        (lambda text: text.replace("\n", ",\n").encode(), None),
        (lambda text: text.replace("velocity_m_s", "Velocity_m_s").encode(), "read as velocity_m_s"),
    ],
    ids=[
        "utf-8 mark", "utf-16", "utf-16 without mark", "latin-1", "windows lines", "old mac lines",
        "decimal commas", "tabs", "semicolons", "blank tail", "comments", "quotes", "blanks",
        "trailing comma", "case",
    ],
)  # fmt: skip
def test_other_dialects_are_read_right_and_the_reading_is_noted(tmp_path, encode, said):
    table = rows()
    path = tmp_path / "r.csv"
    path.write_bytes(encode(csv_text(table)))
    run = load_run(path)
    assert np.allclose(run.force_n, table[:, 4], rtol=1e-8)
    assert np.allclose(run.time_s, table[:, 0], rtol=1e-8)
    assert said is None or any(said in note for note in run.notes)


def test_lines_are_those_of_an_editor_whatever_stands_between(tmp_path):
    text = csv_text(rows()).replace("\n", "\n# remark\n\n", 5)
    lines = text.split("\n")
    lines[40] = lines[40].replace(lines[40].split(",")[1], "fast")
    path = tmp_path / "r.csv"
    path.write_text("\n".join(lines))
    assert f"{path}:41: velocity_m_s is not a number: 'fast'" in complaint(path)


def test_all_problems_of_all_files_are_said_at_once(tmp_path):
    for name in ("a", "b"):
        lines = csv_text(rows()).split("\n")
        lines[5] = "1,2,3"
        lines[9] = lines[9].rsplit(",", 1)[0] + ",nan"
        lines[12] = lines[12].replace("30", "warm")
        lines[14] = lines[14].replace("30", "warm")
        (tmp_path / f"{name}.csv").write_text("\n".join(lines))
    text = complaint(tmp_path)
    assert len(text.splitlines()) == 6
    for name in ("a", "b"):
        assert f"{name}.csv:6: the row has 3 cells where 5 are due" in text
        assert f"{name}.csv:10: force_N is NaN" in text
        assert f"{name}.csv:13: temperature_C is not a number: 'warm' (and so in 1 more rows)" in text


def test_a_bad_cell_does_not_hide_a_missing_column(tmp_path):
    (tmp_path / "r.csv").write_text("time_s,velocity_m_s\n1,x\n")
    lines = complaint(tmp_path).splitlines()
    assert "r.csv:2: velocity_m_s is not a number: 'x'" in lines[0]
    assert "columns are missing: current_A, temperature_C, force_N" in lines[1]


def test_time_stamps_with_jitter_are_taken_as_they_are(tmp_path):
    table = rows()
    table[:, 0] += 1e-4 * np.random.default_rng(2).uniform(-1, 1, len(table))
    run = load_run(write_csv(tmp_path / "r.csv", table))
    assert np.allclose(run.time_s, table[:, 0], atol=1e-8)
    assert run.sample_rate_hz == pytest.approx(1000, rel=1e-4)


def test_rounded_time_stamps_that_repeat_are_read_as_the_even_clock_behind_them(tmp_path):
    table = rows(sine(rate=2387))
    exact = table[:, 0].copy()
    table[:, 0] = np.round(exact, 3)
    run = load_run(write_csv(tmp_path / "r.csv", table))
    assert np.max(np.abs(run.time_s - exact)) < 5e-4
    assert any("rounded" in note for note in run.notes)


def test_a_few_lost_samples_are_interpolated_and_it_is_said(tmp_path):
    table = rows()
    kept = np.delete(table, [100, 101, 700], axis=0)
    run = load_run(write_csv(tmp_path / "r.csv", kept))
    assert len(run) == len(table)
    assert np.max(np.abs(run.velocity_m_s - table[:, 1])) < 0.01
    assert any("interpolated" in note for note in run.notes)
    assert run.row(650) == 2 + 648


def test_a_gap_is_refused_with_its_place(tmp_path):
    path = write_csv(tmp_path / "r.csv", np.delete(rows(), np.s_[400:700], axis=0))
    assert f"{path}:402: a gap: no samples from 0.399 to 0.7 s" in complaint(path)


def test_a_clock_that_runs_backwards_is_refused_with_its_place(tmp_path):
    table = rows()
    table[500:, 0] -= 0.2
    path = write_csv(tmp_path / "r.csv", table)
    assert f"{path}:502: time goes backwards, from 0.499 to 0.3 s" in complaint(path)


def test_a_missing_column_is_named_with_a_guess_which_one_is_meant(tmp_path):
    path = write_csv(tmp_path / "r.csv", header=HEADER.replace("velocity_m_s", "velocity_mm_s"))
    text = complaint(path)
    assert "missing: velocity_m_s" in text
    assert "is it velocity_mm_s for velocity_m_s?" in text
    assert "--columns" in text


def test_columns_that_are_not_used_are_named(tmp_path):
    table = np.column_stack((rows(), rows()[:, 0]))
    run = load_run(write_csv(tmp_path / "r.csv", table, header=HEADER + ",oil_pressure_bar"))
    assert any("oil_pressure_bar" in note for note in run.notes)


def test_what_is_written_is_read_back_exactly(tmp_path):
    run = load_run(write_csv(tmp_path / "r.csv"))
    model = np.sin(run.time_s) * 1e-7
    write_run_csv(run, tmp_path / "out.csv", {"force_model_N": model})
    again = load_run(tmp_path / "out.csv")
    for name in ("time_s", "velocity_m_s", "force_n", "displacement_m", "acceleration_m_s2", "current_a"):
        assert np.array_equal(getattr(run, name), getattr(again, name)), name
    assert again.derived == run.derived
    written = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    assert np.array_equal(written[:, -1], model)


def test_a_derived_velocity_is_written_with_all_kinematics(tmp_path):
    motion = sine()
    table = rows(motion)
    table[:, 1] = motion.x
    run = load_run(
        write_csv(tmp_path / "r.csv", table, header=HEADER.replace("velocity_m_s", "displacement_m"))
    )
    write_run_csv(run, tmp_path / "out.csv")
    again = load_run(tmp_path / "out.csv")
    for name in ("velocity_m_s", "displacement_m", "acceleration_m_s2"):
        assert np.array_equal(getattr(run, name), getattr(again, name)), name


def test_an_extra_column_replaces_one_of_the_same_name_and_what_is_unknown_is_left_out(tmp_path):
    table = np.column_stack((rows()[:, [0, 1, 3, 4]], np.full(len(rows()), 9.0)))
    header = "time_s,velocity_m_s,temperature_C,force_N,current_command_A"
    path = write_csv(tmp_path / "r.csv", table, header=header)
    run = load_run(path)
    assert np.all(run.current_a == 9.0)
    assert any("current_A taken from current_command_A" in note for note in run.notes)
    write_run_csv(run, tmp_path / "out.csv", {"current_command_A": np.full(len(run), 0.5)})
    assert np.all(load_run(tmp_path / "out.csv").current_command_a == 0.5)
    write_csv(path, table[:, :3], header="time_s,velocity_m_s,temperature_C")
    bare = load_run(path, need_force=False, need_current=False)
    write_run_csv(bare, tmp_path / "bare.csv")
    assert (tmp_path / "bare.csv").read_text().split("\n", 1)[0] == "time_s,velocity_m_s,temperature_C"


def test_nothing_half_written_is_left_where_a_path_cannot_be_written(tmp_path):
    run = load_run(write_csv(tmp_path / "r.csv"))
    with pytest.raises(InputError, match="cannot be written"):
        write_run_csv(run, tmp_path / "no" / "out.csv")
    with pytest.raises(ValueError, match="shape"):
        write_run_csv(run, tmp_path / "out.csv", {"force_model_N": np.zeros(3)})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["r.csv"]


def test_a_million_rows_take_a_few_seconds(tmp_path):
    cycle = [",".join(row.split(",")[1:]) for row in csv_text(rows(sine(1.0, 2.0, 5000))).split()[1:]]
    body = "\n".join([f"{k / 5000:.4f},{cycle[k % 10_000]}" for k in range(1_000_000)])
    (tmp_path / "r.csv").write_text(HEADER + "\n" + body + "\n")
    start = time.process_time()
    run = load_run(tmp_path / "r.csv")
    seconds = time.process_time() - start
    assert len(run) == 1_000_000
    assert seconds < 6, f"{seconds:.1f} s of processor time"  # 2 s, but a shared machine stretches even that
