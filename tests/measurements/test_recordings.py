from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings import CAN_MAP, FORCE, MOTION, channels, messages, write_log, write_mat, write_mdf

from mrctl.can.quiet_import import can
from mrctl.errors import InputError
from mrctl.measurements import load_campaign, load_run, require_sound


def complaint(path, columns=None) -> str:
    with pytest.raises(InputError) as caught:
        load_campaign(path, columns)
    return str(caught.value)


def written(path, text):
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "kind",
    [{"version": "5"}, {"version": "4"}, {"hdf5": True}],
    ids=["version 5", "version 4", "version 7.3"],
)
def test_mat_variables_with_the_names_of_the_interface_need_no_map(tmp_path, kind):
    run = load_run(
        write_mat(tmp_path / "run.mat", {**channels(), "temperature_C": 30.0, "remark": 3.0}, **kind)
    )
    assert np.array_equal(run.force_n, FORCE)
    assert np.array_equal(run.time_s, MOTION.time_s)
    assert np.all(run.temperature_c == 30.0)
    assert run.row(0) == 1
    assert any("temperature_C is 30 throughout" in note for note in run.notes)


@pytest.mark.parametrize("hdf5", [False, True], ids=["version 5", "version 7.3"])
def test_mat_structs_and_matrix_columns_come_through_a_map(tmp_path, hdf5):
    table = np.column_stack((MOTION.time_s, 1e3 * MOTION.v))
    tree = {"log": {"table": table, "F": 1e-3 * FORCE}, "i": 0.5}
    path = write_mat(tmp_path / "run.mat", tree, hdf5=hdf5)
    text = """
columns:
  time_s: log.table(:,1)
  velocity_m_s: {column: "log.table(:,2)", unit: mm/s}
  force_N: {column: log.F, unit: kN}
  current_A: i
constants: {temperature_C: {value: 300, unit: K}}
"""
    columns = written(tmp_path / "map.yaml", text)
    run = load_run(path, columns)
    assert np.allclose(run.velocity_m_s, MOTION.v)
    assert np.allclose(run.force_n, FORCE)
    assert np.all(run.current_a == 0.5)
    assert np.allclose(run.temperature_c, 26.85)


def test_a_struct_with_the_names_of_the_interface_needs_no_map(tmp_path):
    run = load_run(write_mat(tmp_path / "run.mat", {"run": channels(), "other": 1.0}))
    assert np.array_equal(run.force_n, FORCE)


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("nothing", "there is no nothing"),
        ("log.F(:,9)", "log.F has no column 9"),
        ("log.table", "log.table is a matrix of"),
        ("note", "note holds no plain numbers"),
        ("log.short", "log.short has 5 values where"),
        ("log[3]", "names no variable"),
    ],
)
def test_places_that_a_mat_file_does_not_have_are_said(tmp_path, place, said):
    log = {"table": np.ones((50, 2)), "F": FORCE, "short": np.ones(5)}
    path = write_mat(tmp_path / "run.mat", {"log": log, "note": "text", "t": MOTION.time_s})
    columns = written(tmp_path / "map.yaml", f"columns: {{time_s: t, force_N: '{place}'}}\n")
    assert said in complaint(path, columns)


def test_mdf_channels_with_the_names_of_the_interface_need_no_map_and_share_the_clock_of_the_force(tmp_path):
    run = load_run(write_mdf(tmp_path / "run.mf4"))
    assert run.sample_rate_hz == pytest.approx(1000)
    assert len(run) > 3700
    assert np.allclose(run.force_n, FORCE[: len(run)])
    assert np.max(np.abs(run.velocity_m_s - MOTION.v[: len(run)])) < 2e-4  # straight lines between 2 ms
    assert any("clock of force_N, 1000 Hz" in note and "current_A held" in note for note in run.notes)


def test_units_that_an_mdf_file_states_are_converted_and_a_map_goes_before(tmp_path):
    path = write_mdf(tmp_path / "run.mf4", {"velocity_m_s": ("mm/s", 1e3), "force_N": ("kN", 1e-3)})
    run = load_run(path)
    assert np.allclose(run.force_n, FORCE[: len(run)])
    assert any("velocity_m_s converted from mm/s" in note for note in run.notes)
    columns = written(
        tmp_path / "map.yaml",
        "columns:\n  velocity_m_s: velocity_m_s\n  force_N: {column: force_N, unit: N}\n"
        "  current_A: current_A\n  temperature_C: temperature_C\n",
    )
    assert np.allclose(load_run(path, columns).force_n, 1e-3 * FORCE[: len(run)])


def test_an_mdf_channel_in_two_groups_needs_the_group(tmp_path):
    path = write_mdf(tmp_path / "run.mf4", twice=("force_N",))
    assert "more than one channel force_N" in complaint(path)
    text = "columns:\n  velocity_m_s: velocity_m_s\n  force_N: {column: force_N, group: 3}\n"
    text += "  current_A: current_A\n  temperature_C: temperature_C\n"
    assert np.allclose(load_run(path, written(tmp_path / "map.yaml", text)).force_n[:100], FORCE[:100])


@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf", ".trc", ".mf4"])
def test_logs_of_all_kinds_give_the_same_run(tmp_path, suffix):
    path = write_log(tmp_path / f"drive{suffix}", messages())
    run = load_run(path, written(tmp_path / "map.yaml", CAN_MAP))
    assert run.sample_rate_hz == pytest.approx(1000, rel=2e-3)
    late = 1e-4  # force frames follow velocity frames by this much; the clock is that of the force
    expected = np.interp(run.time_s + late, MOTION.time_s, MOTION.v)
    assert np.max(np.abs(run.velocity_m_s - expected)) < 1.5e-3  # 0.5 mm/s resolution, 1 ms stamps in some
    assert np.max(np.abs(run.force_n - np.interp(run.time_s, MOTION.time_s, FORCE))) < 40
    assert run.current_a[1000] == 1.0
    assert run.current_a[1600] == 2.0
    assert set(np.unique(run.current_a)) == {1.0, 2.0}, "held, not interpolated"
    assert np.allclose(run.temperature_c, 41.5)
    assert "displacement_m" not in run.derived
    assert require_sound(load_campaign(path, tmp_path / "map.yaml")) == []


def test_each_damper_of_a_vehicle_becomes_a_run(tmp_path):
    path = write_log(tmp_path / "drive.log", messages())
    text = CAN_MAP.replace("_FL", "_{damper}") + "dampers: [FL, RR]\n"
    campaign = load_campaign(path, written(tmp_path / "map.yaml", text))
    assert [run.name for run in campaign.runs] == ["drive.log#FL", "drive.log#RR"]
    assert np.allclose(campaign.runs[0].force_n, -campaign.runs[1].force_n)


def test_damaged_frames_are_left_out_and_counted(tmp_path):
    path = write_log(tmp_path / "drive.log", messages(damage=True))
    run = load_run(path, written(tmp_path / "map.yaml", CAN_MAP))
    assert any("30 of 3000 RelativeVelocity with a wrong CRC, left out" in note for note in run.notes)
    assert np.max(np.abs(run.velocity_m_s - np.interp(run.time_s, MOTION.time_s, MOTION.v))) < 3e-3


def test_error_and_remote_frames_of_candump_are_no_data(tmp_path):
    path = write_log(tmp_path / "drive.log", messages())
    lines = path.read_text().splitlines()
    lines[50:50] = [
        "(1000.010000) can0 20000040#0000000000000000",
        "(1000.010000) can0 110#R",
        "# remark",
        "",
    ]
    lines.append("(1003.0000")
    run = load_run(written(path, "\n".join(lines)), written(tmp_path / "map.yaml", CAN_MAP))
    notes = " ".join(run.notes)
    assert "1 error frames left out" in notes
    assert "1 remote frames left out" in notes
    assert "1 a last line that is cut off left out" in notes
    lines[70] = "this is not a frame"
    assert "drive.log:71: is no line of candump -l" in complaint(
        written(path, "\n".join(lines)), tmp_path / "map.yaml"
    )


def test_one_bus_of_a_log_can_be_chosen(tmp_path):
    path = write_log(tmp_path / "drive.log", messages(0.5))
    lines = path.read_text().splitlines()
    both = [
        text for line in lines for text in (line, line.replace("vcan0", "can7").replace(" 121#", " 122#"))
    ]
    map_of = "{}bus: {}\n".format
    run = load_run(written(path, "\n".join(both)), written(tmp_path / "map.yaml", map_of(CAN_MAP, "vcan0")))
    assert run.sample_rate_hz == pytest.approx(1000)
    said = complaint(path, written(tmp_path / "map.yaml", map_of(CAN_MAP, "can7")))
    assert "has no valid frames MeasuredForce" in said
    said = complaint(path, written(tmp_path / "map.yaml", map_of(CAN_MAP, "can1")))
    assert "has no frames of bus can1; it has can7, vcan0: correct `bus` in the map" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("dbc: mrctl.dbc", "dbc: other.dbc"), "there is no such DBC"),
        (("dbc: mrctl.dbc\n", ""), "no DBC to decode a CAN log with"),
        (("Force_FL", "Kraft_FL"), "no signal Kraft_FL in mrctl.dbc; in N there are ForceWish_FL"),
        (("RelVel_FL", "BodyVel_FL"), "has no valid frames BodyVelocity among its"),
    ],
)
def test_a_log_that_does_not_fit_its_map_is_said(tmp_path, change, said):
    path = write_log(tmp_path / "drive.blf", messages(0.5))
    assert said in complaint(path, written(tmp_path / "map.yaml", CAN_MAP.replace(*change)))


def test_a_log_without_a_map_is_told_what_it_needs(tmp_path):
    path = write_log(tmp_path / "drive.log", messages(0.1))
    assert "a CAN log holds frames, no channels; say with --columns MAP.yaml" in complaint(path)


def test_a_dbc_of_others_with_floats_big_endian_and_no_protection_works(tmp_path):
    dbc = """VERSION ""
BS_:
BU_: A
BO_ 2147484160 Fast: 8 A
 SG_ v : 7|16@0- (0.001,0) [0|0] "m/s" A
 SG_ F : 23|16@0- (0.0005,0) [0|0] "kN" A
BO_ 3 Slow: 8 A
 SG_ T : 0|32@1- (1,0) [0|0] "degF" A
 SG_ i : 32|8@1+ (20,0) [0|0] "mA" A
SIG_VALTYPE_ 3 T : 1;
"""
    (tmp_path / "other.dbc").write_text(dbc)
    database = can_database(tmp_path / "other.dbc")
    frames = []
    for tick in range(1000):
        fast = database.encode_message("Fast", {"v": MOTION.v[tick], "F": FORCE[tick] / 1000})
        frames.append(can.Message(timestamp=tick / 1000, arbitration_id=512, data=fast, is_extended_id=True))
        if tick % 100 == 0:
            slow = database.encode_message("Slow", {"T": 77.0, "i": 500})
            frames.append(
                can.Message(timestamp=tick / 1000, arbitration_id=3, data=slow, is_extended_id=False)
            )
    path = write_log(tmp_path / "x.log", frames)
    text = "dbc: other.dbc\nsignals: {velocity_m_s: v, force_N: F, temperature_C: Slow.T, current_A: i}\n"
    run = load_run(path, written(tmp_path / "map.yaml", text))
    assert np.max(np.abs(run.velocity_m_s - MOTION.v[:1000])) < 1e-3
    assert np.max(np.abs(run.force_n - FORCE[:1000])) < 1
    assert np.allclose(run.temperature_c, 25.0)
    assert np.allclose(run.current_a, 0.5)
    assert any("force_N converted from kN, the unit in the DBC" in note for note in run.notes)


def can_database(path):
    from mrctl.can.quiet_import import cantools  # noqa: PLC0415 - only here

    return cantools.database.load_file(str(path))


@pytest.mark.parametrize(("suffix", "package"), [(".mat", "scipy"), (".mf4", "asammdf")])
def test_a_missing_library_is_said_with_the_extra_that_brings_it(tmp_path, monkeypatch, suffix, package):
    path = tmp_path / f"run{suffix}"
    write_mat(path, channels()) if suffix == ".mat" else write_mdf(path)
    for name in [name for name in sys.modules if name.partition(".")[0] == package]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, package, None)
    said = complaint(path)
    assert f"needs {package}, which is not installed; install it: pip install 'mrctl[desk]'" in said


def test_plain_campaigns_load_no_heavy_library():
    import subprocess  # noqa: PLC0415 - only here

    heavy = "('scipy', 'asammdf', 'pandas', 'can', 'h5py')"
    code = f"import sys, mrctl.measurements; print([n for n in {heavy} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    """A whole file of every format, and the map for those that need one."""
    folder = tmp_path_factory.mktemp("samples")
    frames = messages(0.1)
    files = [write_log(folder / f"drive{suffix}", frames) for suffix in (".log", ".asc", ".blf", ".trc")]
    files += [
        write_mat(folder / "five.mat", channels()),
        write_mat(folder / "seven.mat", channels(), hdf5=True),
    ]
    files.append(write_mdf(folder / "run.mf4"))
    return files, written(folder / "map.yaml", CAN_MAP)


@pytest.mark.filterwarnings("error")
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.integers(0, 6),
    st.floats(0, 1),
    st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=4)), max_size=4),
)
def test_damaged_recordings_raise_nothing_but_input_errors(tmp_path, samples, which, keep, damage):
    files, columns = samples
    source = files[which]
    data = bytearray(source.read_bytes())
    for place, patch in damage:
        at = int(place**3 * (len(data) - 1))  # more often near the beginning, where the structure is
        data[at : at + len(patch)] = patch
    path = tmp_path / source.name
    path.write_bytes(bytes(data[: int(keep * len(data)) + 1]) if not damage else bytes(data))
    try:
        load_campaign(path, columns if source.suffix in {".log", ".asc", ".blf", ".trc"} else None)
    except InputError as error:
        assert str(path) in str(error)  # noqa: PT017 - it need not be raised
