"""Every kind of defect in a configuration, made in a copy of the car's: the line and the mend it gets."""

from __future__ import annotations

import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.config import load_config
from mrctl.errors import InputError
from mrctl.share_path import share_file

CALIBRATION = share_file("config/calibration.yaml").read_text()
DBC = share_file("dbc/mrctl.dbc").read_text()
TEXT = share_file("config/vehicle.yaml").read_text().replace("../dbc/mrctl.dbc", "mrctl.dbc")


def write(folder, text, calibration=CALIBRATION, dbc=DBC):
    (folder / "calibration.yaml").write_text(calibration)
    (folder / "mrctl.dbc").write_text(dbc)
    (folder / "c.yaml").write_text(text, encoding="utf-8")
    return folder / "c.yaml"


def broken(old, new, text=TEXT):
    assert old in text, old
    return text.replace(old, new, 1)


def line_of(text, marker):
    """The number of the one line that holds the marker."""
    lines = [i for i, line in enumerate(text.splitlines(), start=1) if marker in line]
    assert lines, marker
    return lines[0]


def complaints(path):
    with pytest.raises(InputError) as error:
        load_config(path)
    return [(p.file, p.line, f"{p.what}; {p.mend}") for p in error.value.problems]


DAMPERS = re.search(r"\ndampers:.*?(?=\ncontrol:)", TEXT, re.DOTALL)[0]

DEFECTS = {
    # name: (old, new, marker of the line, what is said)
    "polling for all of the period": (
        "poll_us: 60",
        "poll_us: 1500",
        "poll_us:",
        "at most 1000, or the processor does nothing else",
    ),
    "FD without its rate": (
        "fd: false",
        "fd: true",
        "fd: true",
        "`bus.fd` without `bus.data_bitrate`; add it",
    ),
    "a data rate without FD": (
        "data_bitrate: null",
        "data_bitrate: 2000000",
        "data_bitrate:",
        "`bus.data_bitrate` without CAN FD; set",
    ),
    "a data rate below the bit rate": (
        "fd: false\n  data_bitrate: null",
        "fd: true\n  data_bitrate: 100000",
        "data_bitrate: 1",
        "`bus.data_bitrate` (100000) is below `bus.bitrate` (500000); the data phase is at least",
    ),
    "an unknown law": (
        "law: skyhook_continuous",
        "law: skyhook_continous",
        "law: sky",
        "no control law 'skyhook_continous'; did you mean `skyhook_continuous`?",
    ),
    "an unknown map": (
        "current_map: inverse",
        "current_map: magic",
        "current_map",
        "no current map 'magic'; there are: inverse, linear, reader, liu",
    ),
    "an unknown parameter of the law": (
        "sky_n_s_m: 3000",
        "sky_ns_m: 3000",
        "sky_ns_m",
        "no parameter 'sky_ns_m' here; did you mean 'sky_n_s_m'?",
    ),
    "a parameter out of bounds": (
        "sky_n_s_m: 3000",
        "sky_n_s_m: -1",
        "sky_n_s_m",
        "sky_n_s_m is -1; give a number from 0 to 1e+06 N s/m",
    ),
    "a parameter that is text": (
        "sky_n_s_m: 3000",
        "sky_n_s_m: much",
        "sky_n_s_m",
        "sky_n_s_m is 'much'; give",
    ),
    "parameters that do not go together": (
        "minimum_n_s_m: 300 ",
        "minimum_n_s_m: 30000 ",
        "parameters:",
        "skyhook_continuous: ",
    ),
    "a parameter of the map": (
        "map_parameters: {}",
        "map_parameters: {gain: 2}",
        "map_parameters",
        "no parameter 'gain' here; leave it out: there are no parameters",
    ),
    "a signal that the law needs": (
        "      body_velocity: BodyVel_RL\n",
        "",
        "RelVel_RL",
        "damper rear_left; add `body_velocity` or `body_acceleration` to its signals, or choose another law",
    ),
    "two sources of body velocity": (
        "      body_velocity: BodyVel_RL\n",
        "      body_velocity: BodyVel_RL\n      body_acceleration: BodyAcc_RL\n",
        "body_acceleration: BodyAcc_RL",
        "damper rear_left has body_velocity and body_acceleration; keep one",
    ),
    "no relative velocity": (
        "      relative_velocity: RelVel_RL\n",
        "",
        "BodyVel_RL",
        "`dampers.rear_left.signals.relative_velocity` is missing; add `relative_velocity`: damper velocity",
    ),
    "an unknown role": (
        "temperature: CaseTemp_RL",
        "temprature: CaseTemp_RL",
        "temprature",
        "unknown key `dampers.rear_left.signals.temprature`; did you mean `temperature`?",
    ),
    "a signal that the DBC has not": (
        "CaseTemp_RL",
        "CaseTemp_LR",
        "CaseTemp_LR",
        "the DBC has no signal CaseTemp_LR; did you mean `CaseTemp_",
    ),
    "a signal of a frame that does not come": (
        "    BodyVelocity: 500\n",
        "",
        "BodyVel_FL",
        "BodyVel_FL comes in BodyVelocity, which is not in frames.receive; add `BodyVelocity: RATE` there",
    ),
    "a frame that the DBC has not": (
        "    CaseTemperature: 10",
        "    CaseTemp: 10\n    CaseTemperature: 10",
        "CaseTemp: 10",
        "the DBC has no frame CaseTemp; did you mean `CaseTemperature`?",
    ),
    "a command that the DBC has not": (
        "command: Cur_RL",
        "command: Current_RL",
        "Current_RL",
        "CurrentCommand has no signal Current_RL; did you mean `Cur_RL`?",
    ),
    "one command for two dampers": (
        "command: Cur_RL",
        "command:  Cur_FR",
        "command:  Cur_FR",
        "dampers front_right and rear_left have the same command",
    ),
    "a frame that mrctl does not send": (
        "    Health: 10",
        "    Helth: 10",
        "Helth",
        "mrctl sends no frame Helth; did you mean `Health`?",
    ),
    "sending faster than the loop": (
        "CurrentCommand: 500 ",
        "CurrentCommand: 1000 ",
        "CurrentCommand: 1000",
        "CurrentCommand at 1000 Hz is faster than the loop (500 Hz)",
    ),
    "sending at no whole fraction of the loop": (
        "ControllerState: 50",
        "ControllerState: 60",
        "ControllerState: 60",
        "ControllerState at 60 Hz is no whole fraction of the loop's 500 Hz; e.g. 62.5",
    ),
    "receiving faster than the loop": (
        "RelativeVelocity: 500",
        "RelativeVelocity: 600",
        "RelativeVelocity: 600",
        "RelativeVelocity at 600 Hz comes faster than the loop turns (500 Hz); let it",
    ),
    "a bus that is too full": (
        "bitrate: 500000",
        "bitrate: 250000",
        "  receive:",
        "the bus would be loaded to 84.9% at worst, more than bus.load_limit (60%); lower rates",
    ),
    "a time-out shorter than a period": (
        "temperature:                 # degC; stood in for by its last value\n    {timeout_ms: 1000",
        "temperature:                 # degC; stood in for by its last value\n    {timeout_ms: 50",
        "{timeout_ms: 50, minimum: -50.0",
        "(50) is shorter than the period of CaseTemperature (100 ms); give it some periods, e.g. 500",
    ),
    "limits the wrong way round": (
        "minimum: -50.0, maximum: 200.0",
        "minimum: 200.0, maximum: -50.0",
        "minimum: 200.0",
        "`signals.temperature`: minimum 200 is not below maximum -50; swap them",
    ),
    "limp before the time-out": (
        "limp_after_ms: 50,",
        "limp_after_ms: 5,",
        "limp_after_ms: 5,",
        "`signals.relative_velocity`: limp_after_ms 5 is below timeout_ms 10",
    ),
    "limp beyond the damper": (
        "limp_current_a: 1.0",
        "limp_current_a: 4.0",
        "limp_current_a",
        "`safety.limp_current_a` (4 A) is beyond damper front_left's largest current (3 A); choose",
    ),
    "a substitute damping beyond reason": (
        "substitute_damping_n_s_m: 1500",
        "substitute_damping_n_s_m: 1.0e+9",
        "substitute_damping",
        "passive: damping_n_s_m is 1000000000.0; give",
    ),
    "no such DBC": (
        "database: mrctl.dbc",
        "database: other.dbc",
        "database:",
        "other.dbc; give the DBC's path, relative to",
    ),
    "no such calibration": (
        "calibration: calibration.yaml",
        "calibration: other.yaml",
        "calibration:",
        "other.yaml; give the calib",
    ),
    "a rate that is text": (
        "rate_hz: 500 ",
        "rate_hz: 500 Hz ",
        "rate_hz",
        "`loop.rate_hz` is the text '500 Hz'; write the number alone",
    ),
    "a rate of zero": (
        "CaseTemperature: 10",
        "CaseTemperature: 0",
        "CaseTemperature: 0",
        "`frames.receive.CaseTemperature` is 0; it must be greater than 0",
    ),
    "a channel that YAML takes for a truth value": (
        "channel: vcan0 ",
        "channel: on ",
        "channel: on",
        "`bus.channel`: YAML reads on as true; quote it",
    ),
    "a channel that YAML takes for a number": (
        "channel: vcan0 ",
        "channel: 0 ",
        "channel: 0",
        "`bus.channel`: YAML reads 0 as a number; quote it",
    ),
    "an unknown block": ("\nlog:", "\nlogging:", "logging:", "unknown key `logging`; did you mean `log`?"),
    "an unknown level": (
        "level: info ",
        "level: chatty ",
        "level: chatty",
        "`log.level` is 'chatty'; write 'debug', 'info',",
    ),
    "no dampers": (DAMPERS, "", "schema", "`dampers` is missing"),
    "dampers that are none": (
        DAMPERS,
        "\ndampers: {}\n",
        "dampers:",
        "`dampers` has too few entries; at least 1 are needed",
    ),
    "a name that is none": ("  rear_left:\n", "  rear left:\n", "rear left", "rear left"),
    "a newer schema": (
        "mrctl/config/1",
        "mrctl/config/9",
        "schema",
        "schema mrctl/config/9 is newer than this mrctl",
    ),
    "1e-3": (
        "coil_lag_s: 0.008",
        "coil_lag_s: 8e-3",
        "coil_lag_s",
        "YAML reads 8e-3 as text, not as a number; write 8.0e-3",
    ),
    "a duplicate damper": (
        "  rear_left:\n",
        "  front_left:\n",
        "RelVel_RL",
        "`front_left` stands twice, here and in line",
    ),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_each_defect_gets_its_line_and_its_mend(defect, tmp_path):
    old, new, marker, said = DEFECTS[defect]
    text = broken(old, new)
    path = write(tmp_path, text)
    found = complaints(path)
    fitting = [(file, line) for file, line, what in found if said in what]
    assert fitting, found
    file, line = fitting[0]
    assert file == str(path)
    # A key's own line, or that of the block that lacks it: at most three lines above its marker.
    assert line is not None
    assert 0 <= line_of(text, marker) - line <= 3 or line == 1 or "schema" in marker, (line, found)


@pytest.mark.parametrize("key", ["database", "calibration"])
def test_a_path_that_cannot_even_be_looked_at_is_told_with_its_line(key, tmp_path):
    old = {"database": "database: mrctl.dbc", "calibration": "\ncalibration: calibration.yaml"}[key]
    text = broken(old, old.rpartition(" ")[0] + " " + 150 * "é")  # 300 bytes: more than a file's name has
    ((file, line, what),) = complaints(write(tmp_path, text))
    assert (file, line) == (str(tmp_path / "c.yaml"), line_of(text, 150 * "é"))
    assert "cannot be reached (File name too long); give the" in what


def test_what_belongs_together_is_found_at_once(tmp_path):
    text = TEXT
    for old, new in (
        ("law: skyhook_continuous", "law: skyhok"),
        ("CaseTemp_RL", "CaseTemp_XX"),
        ("limp_current_a: 1.0", "limp_current_a: 9.0"),
        ("ControllerState: 50", "ControllerState: 70"),
        ("fd: false", "fd: true"),
        ("level: info", "level: loud"),  # breaks the shape of one block; the others are judged all the same
    ):
        text = broken(old, new, text)
    calibration = CALIBRATION.replace("290.0, 530.0", "530.0, 290.0")
    found = complaints(write(tmp_path, text, calibration=calibration))
    said = " | ".join(what for *_, what in found)
    for part in ("skyhok", "CaseTemp_XX", "70 Hz", "bus.data_bitrate", "loud", "f.force"):
        assert part in said, part
    assert {file for file, *_ in found} == {str(tmp_path / "c.yaml"), str(tmp_path / "calibration.yaml")}


def test_faults_of_the_dbc_are_told_with_its_own_lines(tmp_path):
    dbc = DBC.replace('BA_ "E2EDataIDs" BO_ 272 "26 B9', 'BA_ "E2EDataIDs" BO_ 272 "ZZ B9')
    found = complaints(write(tmp_path, TEXT, dbc=dbc))
    assert [file for file, *_ in found] == [str(tmp_path / "mrctl.dbc")]


def test_a_command_that_cannot_carry_the_current_is_told(tmp_path):
    dbc = DBC.replace("(0.001,0) [0|8.19]", "(0.0001,0) [0|0.819]")
    said = " | ".join(what for *_, what in complaints(write(tmp_path, TEXT, dbc=dbc)))
    assert "Cur_FL carries at most 0.819 A" in said


def test_a_slew_below_the_command_s_resolution_is_told(tmp_path):
    calibration = CALIBRATION.replace("value: 400.0", "value: 0.1")
    said = " | ".join(what for *_, what in complaints(write(tmp_path, TEXT, calibration=calibration)))
    assert (
        "in one tick the current of damper front_left may change by 0.0002 A, less than the resolution"
        in said
    )


def test_a_loop_that_the_filters_cannot_follow_is_told_with_its_mend(tmp_path):
    found = complaints(write(tmp_path, TEXT.replace("rate_hz: 500 ", "rate_hz: 150 ")))
    said = [what for *_, what in found if "loop" in what or "carried" in what]
    assert any("rate_hz" in what or "carried" in what for what in said), found


def test_a_body_velocity_cutoff_that_the_loop_cannot_make_is_told(tmp_path):
    text = TEXT.replace("cutoff_hz: 0.2", "cutoff_hz: 40.0")
    text = re.sub(r"body_velocity: BodyVel_", "body_acceleration: BodyAcc_", text)
    text = text.replace("BodyVelocity: 500", "BodyAcceleration: 200")
    (found,) = complaints(write(tmp_path, text))
    assert "cutoff 40.0 Hz is outside 0 to 25 Hz; 0.05 to 0.2 Hz suits a car" in found[2]


def test_acceleration_does_instead_of_velocity(tmp_path):
    text = re.sub(r"body_velocity: BodyVel_", "body_acceleration: BodyAcc_", TEXT)
    config = load_config(write(tmp_path, text.replace("BodyVelocity: 500", "BodyAcceleration: 200")))
    assert config.dampers["front_left"].signals["body_acceleration"] == "BodyAcc_FL"


def test_the_load_limit_is_the_integrator_s_to_set(tmp_path):
    text = TEXT.replace("load_limit: 0.6", "load_limit: 0.9").replace("bitrate: 500000", "bitrate: 250000")
    assert load_config(write(tmp_path, text)).bus_load.total > 0.6


def test_warnings_of_a_shared_calibration_are_kept_once(tmp_path):
    block = re.search(r"(?<=inverse_filter:\n).*?(?=  refine_cutoff)", CALIBRATION, re.DOTALL)[0]
    calibration = CALIBRATION.replace(
        block, "  sample_rate: {unit: Hz, value: 2000.0}\n  numerator: [1.0]\n  denominator: [1.0]\n"
    ).replace("[0.0, 0.2166, -0.4128, 0.1964]", "[0.0, 0.0, 0.0, 0.0002]")
    (warning,) = load_config(write(tmp_path, TEXT, calibration=calibration)).warnings
    assert "forward times inverse filter" in str(warning)


TOKENS = [
    "0", "-1", "1e-3", ".nan", ".inf", "1.0e+308", "9" * 30, "yes", "~", "[]", "{}", "''", "12:30", "&a",
    "*a", "<<: *a", "!x", "?", "|", "\t", "---", ":", ",", "]", "}", "#", "[1, [2]]", "{a: {b: 1}}", "é\\",
]  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_however_a_file_is_mutilated_nothing_but_an_input_error_comes_out(seed, tmp_path_factory):
    rng = random.Random(seed)
    text = TEXT
    for _ in range(rng.randint(1, 5)):
        lines = text.splitlines(keepends=True)
        k = rng.randrange(len(lines))
        kind = rng.randrange(5)
        if kind == 0:
            del lines[k]
        elif kind == 1:
            lines.insert(k, lines[rng.randrange(len(lines))])
        elif kind == 2 and ":" in lines[k]:
            lines[k] = lines[k].split(":")[0] + ": " + rng.choice(TOKENS) + "\n"
        elif kind == 3:
            lines[k] = " " * rng.randrange(6) + lines[k].lstrip()
        else:
            i = rng.randrange(len(lines[k]) + 1)
            lines[k] = lines[k][:i] + rng.choice(TOKENS) + lines[k][i:]
        text = "".join(lines)
        if not text:
            return
    path = write(tmp_path_factory.mktemp("fuzz"), text)
    try:
        problems = [*load_config(path).warnings]
    except InputError as error:
        problems = [*error.problems]
    assert all("\n" not in str(problem) for problem in problems)


@settings(max_examples=25, deadline=None)
@given(
    path=st.sampled_from(
        [
            ("bus",), ("bus", "bitrate"), ("bus", "load_limit"), ("loop", "rate_hz"), ("dampers",),
            ("control",), ("control", "law"), ("control", "parameters"), ("control", "map_parameters"),
            ("signals",), ("signals", "temperature"), ("safety",), ("safety", "off_ramp_s"), ("frames",),
            ("frames", "receive"), ("frames", "send"), ("plant",), ("database",), ("calibration",), ("log",),
            ("body_velocity_from_acceleration", "cutoff_hz"),
        ]
    ),
    value=st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
        max_leaves=5,
    ),
)  # fmt: skip
def test_whatever_value_stands_anywhere_nothing_but_an_input_error_comes_out(path, value, tmp_path_factory):
    import yaml  # noqa: PLC0415 - only this test writes YAML

    data = yaml.safe_load(TEXT)
    here = data
    for key in path[:-1]:
        here = here[key]
    here[path[-1]] = value
    text = yaml.safe_dump(data, allow_unicode=True)
    try:
        load_config(write(tmp_path_factory.mktemp("fuzz"), text))
    except InputError as error:
        lines = [str(problem) for problem in error.problems]
    else:
        lines = []
    assert all("\n" not in line for line in lines)
