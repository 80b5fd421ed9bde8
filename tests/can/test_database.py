from __future__ import annotations

from pathlib import Path

import pytest

from mrctl.can import frames
from mrctl.can.database import load_database
from mrctl.can.dbc_file import DbcFile
from mrctl.errors import InputError
from mrctl.share_path import share_file

DBC = share_file("dbc/mrctl.dbc")
FRAMES = load_database(DBC)
DAMPERS = ("FL", "FR", "RL", "RR")


def test_the_default_dbc_has_every_frame_and_signal_that_mrctl_knows() -> None:
    names = [*frames.SENSOR_FRAMES, *frames.FRAMES_OUT]
    required = {name: frames.signals_of(name, DAMPERS) for name in names}
    loaded = load_database(DBC, required)
    assert list(loaded) == names
    for name in names:
        assert tuple(signal.name for signal in loaded[name].signals) == required[name]
    assert set(FRAMES) == set(names)


def test_every_default_frame_has_its_own_identifier_cycle_and_data_ids() -> None:
    assert len({spec.can_id for spec in FRAMES.values()}) == len(FRAMES)
    for spec in FRAMES.values():
        assert spec.length == 8
        assert not spec.extended
        assert spec.linux_id == spec.can_id
        assert spec.cycle_s is not None
        assert len(spec.data_ids) == 16
    cycles = {name: spec.cycle_s for name, spec in FRAMES.items()}
    assert cycles["RelativeVelocity"] == cycles["BodyVelocity"] == cycles["CurrentCommand"] == 0.002
    assert (cycles["CaseTemperature"], cycles["ControllerState"], cycles["Health"]) == (0.1, 0.02, 0.1)


def test_faster_frames_win_the_arbitration() -> None:
    by_priority = sorted(FRAMES.values(), key=lambda spec: spec.can_id)
    cycles = [spec.cycle_s or 0 for spec in by_priority]
    assert cycles == sorted(cycles)


def test_every_default_frame_and_signal_has_a_comment() -> None:
    for message in DbcFile.read(DBC).messages().values():
        assert message.comment, message.name
        for signal in message.signals:
            assert signal.comment or signal.name.endswith(("_CRC", "_Counter")), signal.name


def test_states_and_causes_are_those_of_the_dbc() -> None:
    message = DbcFile.read(DBC).messages()["ControllerState"]
    for damper in DAMPERS:
        states = message.get_signal_by_name(f"State_{damper}").choices
        assert {int(raw): str(text) for raw, text in states.items()} == {
            s.value: s.name for s in frames.State
        }
        causes = message.get_signal_by_name(f"Cause_{damper}").choices
        assert {int(raw): str(text) for raw, text in causes.items()} == dict(enumerate(frames.CAUSES))
    assert len(frames.CAUSES) == 32


def _changed(folder: Path, *changes: tuple[str, str]) -> Path:
    text = DBC.read_text(encoding="cp1252")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "changed.dbc"
    path.write_text(text, encoding="cp1252")
    return path


def _problems(path: Path, required: dict[str, list[str]] | None = None) -> list[str]:
    with pytest.raises(InputError) as caught:
        load_database(path, required)
    return [str(problem).removeprefix(f"{path}:") for problem in caught.value.problems]


RELVEL_FL = ' SG_ RelVel_FL : 12|13@1- (0.0005,0) [-2.0475|2.0475] "m/s" MRCTL\n'
DATA_IDS = 'BA_ "E2EDataIDs" BO_ 272 "'
LINES = DBC.read_text(encoding="cp1252").splitlines()
LINE = 1 + LINES.index("BO_ 272 RelativeVelocity: 8 VEHICLE")
VALUES_LINE = LINES.index('VAL_ 272 RelVel_FL -4096 "SNA" ;')  # one line up once the signal is gone


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("BO_ 272 RelativeVelocity: 8", "BO_ 272 RelativeVelocity 8", f"{LINE}: is not DBC at column"),
        ("BO_ 272 RelativeVelocity", "BO_ 272 RelativVelocity", " frame RelativeVelocity is missing; add it"),
        ("BO_ 273 ", "BO_ 272 ", "cantools refuses it: unused VAL_"),
        (" SG_ RelVel_CRC : 0|8", " SG_ RelVel_CRC : 0|7", f"{LINE}: frame RelativeVelocity lacks E2E"),
        ("RelVel_Counter : 8|4@1+", "RelVel_Counter : 8|3@1+", f"{LINE}: frame RelativeVelocity lacks E2E"),
        ("RelVel_FL : 12|13", "RelVel_FL : 13|13", f"{LINE}: cantools refuses it: The signals RelVel"),
        ("RelVel_RR : 51|13", "RelVel_RR : 52|13", f"{LINE}: cantools refuses it: The signal RelVel_RR does"),
        (
            DATA_IDS,
            'BA_ "E2EDataIDs" BO_ 288 "',
            f"{LINE}: frame RelativeVelocity has no attribute E2EDataIDs",
        ),
        (DATA_IDS, DATA_IDS + "11 ", f"{LINE}: E2EDataIDs of RelativeVelocity has 17 bytes instead of 16"),
        (DATA_IDS, DATA_IDS + "XY ", f"{LINE}: E2EDataIDs of RelativeVelocity is not bytes in hex"),
        (
            RELVEL_FL,
            RELVEL_FL.replace("0.0005,0", "0,0"),
            f"{LINE + 3}: signal RelVel_FL of RelativeVelocity has",
        ),
        (
            '272 RelVel_FL -4096 "SNA"',
            '272 RelVel_FL 5 "SNA"',
            f"{LINE + 3}: signal RelVel_FL of RelativeVelocity has",
        ),
        (
            "[-2.0475|2.0475]",
            "[3|4]",
            f"{LINE + 3}: signal RelVel_FL of RelativeVelocity has no value between",
        ),
        (
            RELVEL_FL,
            "",
            f"{VALUES_LINE}: cantools refuses it: unused VAL_ entries in DBC: VAL_ 272 RelVel_FL",
        ),
        ("BO_ 273 BodyVelocity", "BO_ 273 RelativeVelocity", ": frame RelativeVelocity stands there twice"),
        ('BA_ "E2EDataIDs" BO_ 272', 'BA_ "Unknown" BO_ 272', " cantools refuses it: 'Unknown'"),
        (
            RELVEL_FL,
            RELVEL_FL.replace("_FL", "_FL M"),
            f"{LINE + 3}: signal RelVel_FL of RelativeVelocity is mul",
        ),
    ],
)
def test_a_faulty_dbc_is_said_with_its_line_and_the_mend(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    required = {"RelativeVelocity": ["RelVel_FL", "RelVel_RR"], "BodyVelocity": ["BodyVel_FL"]}
    problems = _problems(_changed(tmp_path, (old, new)), required)
    assert any(said in problem for problem in problems), problems
    assert all(";" in problem for problem in problems)
    assert all("\n" not in problem for problem in problems)


def test_all_problems_of_a_file_are_said_at_once(tmp_path: Path) -> None:
    path = _changed(tmp_path, (DATA_IDS, DATA_IDS + "11 "), ("BO_ 768 Case", "BO_ 768 Cold"))
    required = {"RelativeVelocity": ["RelVel_X", "RelVel_Y"], "CaseTemperature": [], "Health": ["Mood"]}
    assert len(_problems(path, required)) == 5


def test_two_frames_cannot_share_an_identifier_or_a_name(tmp_path: Path) -> None:
    path = tmp_path / "twice.dbc"
    frame = ' SG_ C : 0|8@1+ (1,0) [0|0] "" B\n SG_ N : 8|4@1+ (1,0) [0|0] "" B\n'
    path.write_text(
        f'VERSION ""\nNS_ :\nBS_:\nBU_: A B\nBO_ 5 F: 8 A\n{frame}BO_ 5 G: 8 A\n{frame}BO_ 6 F: 8 A\n{frame}'
        'BA_DEF_ BO_ "E2EDataIDs" STRING ;\nBA_DEF_DEF_ "E2EDataIDs" "5A";\n'
    )
    assert _problems(path) == [
        "8: frames F and G have the same ID 0x5; give each its own",
        "5: frame F stands there twice; keep one",
    ]


def test_an_ieee_float_is_refused_where_it_is_needed_and_ignored_where_not(tmp_path: Path) -> None:
    body = (
        'VERSION ""\nNS_ :\nBS_:\nBU_: A B\nBO_ 5 F: 8 A\n SG_ C : 0|8@1+ (1,0) [0|0] "" B\n'
        ' SG_ N : 8|4@1+ (1,0) [0|0] "" B\n SG_ X : 12|8@1+ (1,0) [0|0] "" B\n'
        ' SG_ Y : 32|32@1- (1,0) [0|0] "" B\n'
        'BA_DEF_ BO_ "E2EDataIDs" STRING ;\nBA_DEF_DEF_ "E2EDataIDs" "5A";\nSIG_VALTYPE_ 5 Y : 1;\n'
    )
    path = tmp_path / "float.dbc"
    path.write_text(body)
    assert _problems(path, {"F": ["Y"]}) == [
        "9: signal Y of F is an IEEE float; make it an integer with a factor"
    ]
    assert [signal.name for signal in load_database(path, {"F": ["X"]})["F"].signals] == ["X"]


def test_a_missing_file_and_rubbish_are_said(tmp_path: Path) -> None:
    assert "cannot be read: No such file" in _problems(tmp_path / "none.dbc")[0]
    assert "cannot be read: Is a directory" in _problems(tmp_path)[0]
    rubbish = tmp_path / "rubbish.dbc"
    rubbish.write_bytes(bytes(range(256)) * 20)
    assert "is not DBC" in _problems(rubbish)[0]
    empty = tmp_path / "empty.dbc"
    empty.touch()
    assert "is not DBC" in _problems(empty)[0]


def test_a_tighter_range_in_the_dbc_is_kept() -> None:
    (signal,) = load_database(DBC, {"Health": ["LatenessP50"]})["Health"].signals
    assert (signal.minimum, signal.maximum, signal.raw_maximum, signal.sna_raw) == (0, 504, 126, 127)


def test_sna_of_a_signed_signal_may_be_written_without_its_sign(tmp_path: Path) -> None:
    path = _changed(tmp_path, ('272 RelVel_FL -4096 "SNA"', '272 RelVel_FL 4096 "signal_not_available"'))
    (signal,) = load_database(path, {"RelativeVelocity": ["RelVel_FL"]})["RelativeVelocity"].signals
    assert signal.sna_raw == -4096


def test_unknown_frames_have_no_signals() -> None:
    with pytest.raises(KeyError):
        frames.signals_of("Nonsense", DAMPERS)
