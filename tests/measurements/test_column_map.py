from __future__ import annotations

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from motions import csv_text, rows, sine

from mrctl.errors import InputError
from mrctl.measurements import load_campaign, load_run
from mrctl.measurements.column_map import read_map

NAMES = ("time_s", "velocity_m_s", "current_A", "temperature_C", "force_N")


def mapped(tmp_path, text, data, name="run.txt"):
    """Load one file through a map."""
    (tmp_path / "map.yaml").write_text(text)
    (tmp_path / name).write_text(data)
    return load_run(tmp_path / name, tmp_path / "map.yaml")


def _read(tmp_path, data):
    path = tmp_path / "map.yaml"
    return read_map(path) if data is None else load_campaign(tmp_path / "run.txt", path)


def complaints(tmp_path, text, data=None) -> str:
    (tmp_path / "map.yaml").write_text(text)
    if data is not None:
        (tmp_path / "run.txt").write_text(data)
    with pytest.raises(InputError) as caught:
        _read(tmp_path, data)
    return str(caught.value)


def test_the_real_sines_come_in_si_with_the_current_of_their_names(utfsm, sines_map):
    campaign = load_campaign(utfsm, sines_map)
    assert len(campaign) == 20
    currents = {run.name: run.current_a[0] for run in campaign.runs}
    assert currents["10mm1Hz0x25A.txt"] == 0.25
    assert currents["2mm5Hz1A.txt"] == 1.0
    for run in campaign.runs:
        raw = np.loadtxt(run.file)
        assert np.array_equal(run.time_s, raw[:, 0])
        if "velocity_m_s" in run.derived:  # the file's is the last step of displacement, half a sample off
            assert any("half a sample off" in note for note in run.notes)
            steps = np.diff(raw[:, 1]) / np.diff(raw[:, 0]) * 1e-3
            assert np.std(raw[1:, 2] * 1e-3 - steps) < 0.02 * np.std(steps)
            middle = 0.5e-3 * (raw[1:-1, 2] + raw[2:, 2])
            assert np.std(run.velocity_m_s[1:-1] - middle) < 0.02 * np.std(middle)
        else:
            assert np.allclose(run.velocity_m_s, raw[:, 2] * 1e-3, rtol=1e-12)
        assert np.allclose(run.displacement_m, raw[:, 1] * 1e-3, rtol=1e-12)
        assert np.array_equal(run.force_n, raw[:, 3])
        assert run.temperature_c[0] == pytest.approx(22.2222, abs=1e-3)
        assert "acceleration_m_s2" in run.derived


def test_the_real_recording_in_volts_falls_into_five_runs(utfsm, raw_map):
    campaign = load_campaign(utfsm, raw_map)
    assert [run.current_a[0] for run in campaign.runs] == [0, 0.25, 0.5, 0.75, 1]
    assert [len(run) for run in campaign.runs] == [11900, 10100, 9100, 9400, 11200]
    assert [run.row(0) for run in campaign.runs] == [8, 11908, 22008, 31108, 40508]
    assert campaign.runs[0].displacement_m[0] == pytest.approx(-2.9934 * 0.01)
    assert campaign.runs[0].force_n[0] == pytest.approx(0.0504 * 980.665)
    for run in campaign.runs:  # 10 mm at 2 Hz
        assert np.max(np.abs(run.velocity_m_s)) == pytest.approx(0.122, rel=0.02)


def test_a_velocity_derived_from_the_real_displacement_is_the_one_that_was_given(utfsm, sines_map, tmp_path):
    text = sines_map.read_text().replace("  velocity_m_s: {column: 3, unit: mm/s}\n", "")
    (tmp_path / "without.yaml").write_text(text)
    with_it = load_campaign(utfsm, sines_map)
    without = load_campaign(utfsm, tmp_path / "without.yaml")
    for stated, derived in zip(with_it.runs, without.runs, strict=True):
        if stated.name.startswith("2mm5Hz"):
            continue  # its given velocity is itself a difference over several of the 40 samples of a cycle
        assert np.std(derived.velocity_m_s - stated.velocity_m_s) < 0.005 * np.std(stated.velocity_m_s)


@pytest.mark.parametrize(
    ("channel", "unit", "factor", "offset"),
    [
        ("velocity_m_s", "mm/s", 1e-3, 0),
        ("velocity_m_s", "in/s", 0.0254, 0),
        ("force_N", "kN", 1e3, 0),
        ("force_N", "lbf", 4.4482216152605, 0),
        ("force_N", "kgf", 9.80665, 0),
        ("temperature_C", "degF", 5 / 9, -160 / 9),
        ("temperature_C", "K", 1, -273.15),
        ("current_A", "mA", 1e-3, 0),
        ("time_s", "ms", 1e-3, 0),
        ("time_s", "min", 60, 0),
    ],
)
def test_units_are_converted_at_the_door(tmp_path, channel, unit, factor, offset):
    table = rows()
    index = NAMES.index(channel)
    table[:, index] = (table[:, index] - offset) / factor
    columns = "\n".join(f"  {name}: {name}" for name in NAMES if name != channel)
    run = mapped(
        tmp_path, f"columns:\n{columns}\n  {channel}: {{column: {channel}, unit: {unit}}}\n", csv_text(table)
    )
    attribute = channel.replace("_A", "_a").replace("_N", "_n").replace("_C", "_c")
    assert np.allclose(getattr(run, attribute), rows()[:, index], rtol=1e-6, atol=1e-6)
    assert attribute in run.declared


def test_displacement_in_inches_and_acceleration_in_g(tmp_path):
    motion = sine()
    table = np.column_stack((rows(motion), motion.x / 0.0254, motion.a / 9.80665))
    text = "header: 0\ncolumns:\n  time_s: 1\n  velocity_m_s: 2\n  current_A: 3\n"
    text += "  temperature_C: 4\n  force_N: 5\n"
    text += "  displacement_m: {column: 6, unit: in}\n  acceleration_m_s2: {column: 7, unit: g}\n"
    run = mapped(tmp_path, text, csv_text(table).split("\n", 1)[1])
    assert np.allclose(run.displacement_m, motion.x, atol=1e-9)
    assert np.allclose(run.acceleration_m_s2, motion.a, atol=1e-6)


def test_scale_offset_and_sign_apply_in_the_given_unit(tmp_path):
    table = rows()
    text = "columns:\n  time_s: 1\n  velocity_m_s: 2\n  current_A: 3\n  temperature_C: 4\n"
    text += "  force_N: {column: 5, unit: kN, scale: 0.002, offset: 0.5, sign: -1}\n"
    run = mapped(tmp_path, text, csv_text(table))
    assert np.allclose(run.force_n, -1000 * (0.002 * table[:, 4] + 0.5), rtol=1e-6, atol=1e-6)


def test_a_map_may_set_everything_about_the_layout(tmp_path):
    body = csv_text(rows(), delimiter="|").split("\n", 1)[1].replace(".", ",")
    text = "delimiter: '|'\ndecimal: comma\nskip_lines: 2\nheader: 0\ncomment: '%'\nencoding: utf-16\n"
    text += "columns: {time_s: 1, velocity_m_s: 2, current_A: 3, temperature_C: 4, force_N: 5}\n"
    (tmp_path / "map.yaml").write_text(text)
    (tmp_path / "run.txt").write_bytes(f"made by\na bench\n% remark\n{body}".encode("utf-16"))
    run = load_run(tmp_path / "run.txt", tmp_path / "map.yaml")
    assert np.allclose(run.force_n, rows()[:, 4], rtol=1e-8)
    assert run.row(0) == 4


def test_every_slip_of_a_map_is_said_with_its_line(tmp_path):
    text = """schema: mrctl/columns/1
delimeter: comma
columns:
  velocity: 2
  force_N: {column: 3, unit: mm}
  displacement_m: {column: 0}
  current_A: {column: 4, unit: V}
constants:
  temperature_C: warm
header: -1
"""
    said = complaints(tmp_path, text)
    assert "map.yaml:2: unknown key `delimeter`; did you mean `delimiter`?" in said
    assert ":6: `columns.displacement_m.column`: 0 is no column; write its name, or its number from 1" in said
    assert ":9:" in said
    assert ":10:" in said


def test_units_and_names_that_make_no_sense_are_said_with_their_lines(tmp_path):
    text = """columns:
  velocity: 2
  force_N: {column: 3, unit: mm}
  current_A: {column: 4, unit: V}
  displacement_m: {column: 5, scale: ten mm}
constants:
  force_N: 3
from_name: {pattern: "(?P<current_A>[0-9]+)(?P<amp>.)", units: {temperature_C: K}}
split: {column: 3, values: {force_N: [1, 2]}}
"""
    said = complaints(tmp_path, text)
    assert ":2: velocity is no channel; did you mean velocity_m_s?" in said
    assert ":3: force_N: unit mm is not understood here; it may be N, kN" in said
    assert ":4: current_A: V says nothing about A; write what a volt is, like scale: 10 A/V" in said
    assert ":5: displacement_m: scale 'ten mm' is not understood" in said
    assert ":7: force_N has a column too" in said
    assert (
        ":8: current_A has a column or constant too" in said
        or "the pattern has no group temperature_C" in said
    )
    assert ":9: `split` needs either `after` or `before`" in said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("columns: {force_N: 9}", "there is no column 9, only 5"),
        ("columns: {force_N: load}", "no column is named load; there are time_s"),
        ("columns: {force_N: load}\nheader: 0", "there is no header to find load in"),
        ("columns: {force_N: 5}", "columns are missing: time_s, velocity_m_s, current_A, temperature_C"),
        ("columns: {force_N: 5}\nfrom_name: {pattern: 'x(?P<current_A>[0-9]+)y'}", "the name does not match"),
        ("columns: {force_N: 5}\nsplit: {column: 1, after: END}", "no row has the event 'END'"),
        ("columns: {force_N: 5}\nheader: 99999", "line 99999 cannot be the header"),
        ("columns: {force_N: 5}\nencoding: klingon", "unknown encoding klingon"),
    ],
)
def test_a_map_that_does_not_fit_the_file_is_said(tmp_path, text, said):
    assert said in complaints(tmp_path, text + "\n", csv_text(rows()))


def test_parts_and_values_must_be_as_many(tmp_path):
    table = csv_text(rows()).split("\n")
    table[0] += ",event"
    table[600] += ",STOP"
    text = "columns: {time_s: 1, velocity_m_s: 2, force_N: 5, temperature_C: 4}\n"
    text += "split: {column: event, before: STOP, values: {current_A: [0, 1, 2]}}\n"
    assert "2 parts, but `split` gives 3 values of current_A" in complaints(tmp_path, text, "\n".join(table))


def test_files_of_a_map_are_chosen_by_its_globs(tmp_path):
    for name in ("a.dat", "b.dat", "c.txt"):
        (tmp_path / name).write_text(csv_text(rows()))
    text = "columns: {time_s: 1, velocity_m_s: 2, current_A: 3, temperature_C: 4, force_N: 5}\n"
    (tmp_path / "map.yaml").write_text(text + "files: ['*.dat']\n")
    campaign = load_campaign(tmp_path, tmp_path / "map.yaml")
    assert [run.name for run in campaign.runs] == ["a.dat", "b.dat"]
    (tmp_path / "map.yaml").write_text(text + "files: '*.nix'\n")
    with pytest.raises(InputError, match=r"no \*.nix file in this folder"):
        load_campaign(tmp_path, tmp_path / "map.yaml")


def test_an_example_in_the_documentation_of_the_map_is_a_sound_map(tmp_path):
    import mrctl.measurements.column_map as module  # noqa: PLC0415 - its text is the subject here

    blocks = [block for block in (module.__doc__ or "").split("\n\n") if block.lstrip().startswith("schema:")]
    assert len(blocks) == 3
    for block in blocks:
        (tmp_path / "map.yaml").write_text("\n".join(line[4:] for line in block.split("\n")))
        assert read_map(tmp_path / "map.yaml").places


WORDS = st.sampled_from(
    [
        "force_N",
        "time_s",
        "velocity_m_s",
        "current_A",
        "mm",
        "N",
        "V",
        "10 mm/V",
        "comma",
        "whitespace",
        "1",
        "x(",
        "",
    ]
)
SCALARS = st.one_of(WORDS, st.integers(), st.floats(), st.booleans(), st.none(), st.text(max_size=5))
SPECS = st.dictionaries(
    st.sampled_from(["column", "unit", "scale", "offset", "sign", "value", "group"]), SCALARS
)
BLOCKS = st.dictionaries(WORDS, st.one_of(SCALARS, SPECS), max_size=4)
KEYS = [
    "files",
    "format",
    "delimiter",
    "decimal",
    "header",
    "skip_lines",
    "comment",
    "encoding",
    "sample_rate_hz",
]
MAPS = st.fixed_dictionaries(
    {},
    optional={
        **dict.fromkeys(KEYS, SCALARS),
        **dict.fromkeys(["columns", "constants", "signals"], BLOCKS),
        "from_name": st.fixed_dictionaries({"pattern": st.one_of(WORDS, st.just("(?P<force_N>.)"))}),
        "split": st.dictionaries(
            st.sampled_from(["column", "after", "before", "values"]), st.one_of(SCALARS, BLOCKS)
        ),
    },
)
GOOD = {"columns": {"time_s": 1, "velocity_m_s": 2, "current_A": 3, "temperature_C": 4, "force_N": 5}}


@pytest.mark.filterwarnings("error")
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(MAPS, st.booleans())
def test_random_maps_raise_nothing_but_input_errors(tmp_path, content, with_columns):
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(content | (GOOD if with_columns else {})))
    (tmp_path / "run.txt").write_text(csv_text(rows()[:30]))
    try:
        load_campaign(tmp_path / "run.txt", tmp_path / "map.yaml")
    except InputError as error:
        assert str(tmp_path) in str(error)  # noqa: PT017 - it need not be raised
