"""Logs of every format and in every bad shape give the same commands; what is no data is counted."""

from __future__ import annotations

import gzip
import importlib
import json
import random
from datetime import UTC, datetime

import can
import pytest
from replay.recording import (
    CHANNEL,
    CONFIG,
    EPOCH_NS,
    candump,
    first_difference,
    line,
    live,
    sent_lines,
    write,
)

from mrctl.cli.main import main
from mrctl.config import load_config
from mrctl.errors import InputError
from mrctl.judge.e2e import expected_crc
from mrctl.replay.candump import are_deltas, stamp_ns
from mrctl.replay.run import Options, replay

CONFIGURATION = load_config(CONFIG)
TICKS = 1500


@pytest.fixture(scope="module")
def rows():
    return live(TICKS)[0]


@pytest.fixture(scope="module")
def lines(rows):
    return candump(rows)


def commands_of(path, tmp_path, options=None):
    """The figures, and the payloads of the commands that were sent again."""
    out = tmp_path / "out.log"
    figures = replay(path, CONFIGURATION, options, out=out).figures
    return figures, [
        text.split("#")[1] for text in sent_lines(out.read_text().splitlines(), ["CurrentCommand"])
    ]


def expected(lines):
    return [text.split("#")[1] for text in sent_lines(lines, ["CurrentCommand"])]


def same(path, lines, tmp_path, options=None):
    """Replay, hold the commands to those in the lines, give the figures."""
    figures, again = commands_of(path, tmp_path, options)
    assert first_difference(again, expected(lines)) is None
    assert figures["differences"] == 0
    assert figures["compared"]["commands"] == TICKS
    return figures


def console(rows, stamp):
    """As candump prints on a console, with stamps as the function makes them of ns."""
    out = []
    for at, can_id, data in rows:
        payload = " ".join(f"{byte:02X}" for byte in data)
        out.append(f" ({stamp(at)})  {CHANNEL}  {can_id:03X}   [{len(data)}]  {payload}")
    return out


def micro(ns):
    return f"{ns // 10**9:03d}.{ns // 1000 % 10**6:06d}"


def test_gzipped(tmp_path, lines):
    path = tmp_path / "bus.log.gz"
    path.write_bytes(gzip.compress(("\n".join(lines) + "\n").encode()))
    same(path, lines, tmp_path)


def test_the_console_form_with_absolute_stamps(tmp_path, rows, lines):
    same(write(tmp_path / "c.log", console(rows, lambda at: micro(at + EPOCH_NS))), lines, tmp_path)


def test_the_console_form_with_dates(tmp_path, rows, lines):
    def date(at):
        whole = datetime.fromtimestamp((at + EPOCH_NS) // 10**9, tz=UTC).astimezone()
        return f"{whole:%Y-%m-%d %H:%M:%S}.{at // 1000 % 10**6:06d}"

    same(write(tmp_path / "c.log", console(rows, date)), lines, tmp_path)


def test_stamps_from_zero(tmp_path, rows, lines):
    first = rows[0][0]
    same(write(tmp_path / "c.log", console(rows, lambda at: micro(at - first))), lines, tmp_path)


@pytest.mark.parametrize("form", ["console", "log"])
def test_stamps_from_frame_to_frame_are_found_out(tmp_path, rows, lines, form):
    before = [rows[0][0]]

    def delta(at):
        step, before[0] = at - before[0], at
        return step

    if form == "console":
        text = console(rows, lambda at: micro(delta(at)))
    else:
        text = [line(delta(at), can_id, data) for at, can_id, data in rows]
    figures = same(write(tmp_path / "c.log", text), lines, tmp_path)
    assert any("frame to frame" in note for note in figures["notes"])


def test_stamps_of_other_kinds_are_no_deltas():
    steps = [random.Random(1).randrange(1, 4_000_000) for _ in range(500)]
    rising = [sum(steps[:k]) for k in range(500)]
    assert are_deltas([0, *steps])
    assert are_deltas([0, *[2_000_000] * 100])
    assert not are_deltas(rising)
    assert not are_deltas([EPOCH_NS + at for at in rising])
    assert not are_deltas([0])
    assert stamp_ns("12.5") == 12_500_000_000
    assert stamp_ns("12.123456789") == 12_123_456_789
    assert stamp_ns("later") is None


@pytest.mark.parametrize("suffix", ["asc", "blf", "trc"])
def test_formats_that_python_can_writes(tmp_path, rows, lines, suffix):
    path = tmp_path / f"bus.{suffix}"
    with can.Logger(str(path)) as writer:
        for at, can_id, data in rows:
            writer(
                can.Message(
                    timestamp=(at + EPOCH_NS) / 1e9,
                    arbitration_id=can_id,
                    data=data,
                    is_extended_id=False,
                    channel=0,
                )
            )
    figures, again = commands_of(path, tmp_path)
    assert first_difference(again, expected(lines)) is None
    assert figures["differences"] == 0
    assert figures["frames"] == len(rows)
    assert "only one" in figures["notes"][-1]


def test_mf4(tmp_path, rows, lines):
    path = tmp_path / "bus.mf4"
    # mrctl imports python-can without asammdf where it comes first; the writer needs it.
    writer = importlib.reload(can.io.mf4).MF4Writer
    with writer(str(path), database=None) as log:
        for at, can_id, data in rows:
            log(
                can.Message(
                    timestamp=(at + EPOCH_NS) / 1e9,
                    arbitration_id=can_id,
                    data=data,
                    is_extended_id=False,
                    channel=1,
                )
            )
    figures, again = commands_of(path, tmp_path)
    assert first_difference(again, expected(lines)) is None
    assert figures["frames"] == len(rows)


def test_whatever_is_no_data_is_counted_and_changes_nothing(tmp_path, lines):
    rng = random.Random(2)
    added = {
        "error_frame": f"{{}} {CHANNEL} 20000004#0004000000000000",
        "bus_off": f"{{}} {CHANNEL} 20000040#0000000000000000",
        "other_error": f"{{}} {CHANNEL} 20000002#0000000000000000",
        "remote_frame": f"{{}} {CHANNEL} 111#R8",
        "foreign_remote": f"{{}} {CHANNEL} 555#R",
        "foreign": f"{{}} {CHANNEL} 7FF#DEADBEEF",
        "foreign_extended": f"{{}} {CHANNEL} 18FF0110#DEADBEEF01020304",
        "fd_frame": f"{{}} {CHANNEL} 110##1" + "00" * 12,
        "other_interface": "{} can7 110#0000000000000000",
        "bad_line": "{} vcan0 11#00",
    }
    counts = dict.fromkeys(added, 0)
    out = []
    for k, text in enumerate(lines):
        if 10 < k < len(lines) - 8 and rng.random() < 0.2:
            kind = rng.choice(list(added))
            counts[kind] += 1
            out.append(added[kind].format(text.split()[0]))
        out.append(text)
    out += ["", "# a remark", "rubbish", lines[-1][:-4] + "\x00\xff"]
    path = tmp_path / "bus.log"
    path.write_text("\n".join(out) + "\n(1700000009.0", encoding="latin-1")
    figures = same(path, lines, tmp_path)
    rejected, traffic = figures["rejected"], figures["traffic"]
    assert rejected["error_frame"] == counts["error_frame"] + counts["bus_off"] + counts["other_error"]
    assert rejected["remote_frame"] == counts["remote_frame"] + counts["foreign_remote"]
    assert rejected["fd_frame"] == counts["fd_frame"]
    assert rejected["bad_line"] == counts["bad_line"] + 2
    assert rejected["truncated_line"] == 1
    assert set(rejected) == {"error_frame", "remote_frame", "fd_frame", "bad_line", "truncated_line"}
    assert traffic["bus_off"] == counts["bus_off"]
    assert traffic["foreign"] == counts["foreign"] + counts["foreign_extended"]
    assert traffic["other_interfaces"] == counts["other_interface"]
    assert any("first line" in note for note in figures["notes"])


@pytest.mark.parametrize("cut", [1, 2, 3, 8, 17, 25, 30])
def test_a_last_line_that_is_cut_off_is_no_frame(tmp_path, lines, cut):
    path = tmp_path / "bus.log"
    path.write_text("\n".join(lines)[:-cut], encoding="ascii")
    figures = replay(path, CONFIGURATION).figures
    assert figures["rejected"] == {"truncated_line": 1}
    assert figures["differences"] == 0


def test_a_last_line_without_its_end_is_a_frame(tmp_path, lines):
    path = tmp_path / "bus.log"
    path.write_text("\n".join(lines), encoding="ascii")
    same(path, lines, tmp_path)


def test_frames_a_little_out_of_order_are_sorted(tmp_path, rows, lines):
    rng = random.Random(4)
    keys = [
        (at + (rng.randrange(15_000_000) if rng.random() < 0.3 else 0), k)
        for k, (at, _, _) in enumerate(rows)
    ]
    mixed = [lines[k] for _, k in sorted(keys)]
    assert mixed != lines
    figures = same(write(tmp_path / "bus.log", mixed), lines, tmp_path)
    assert figures["log_clock"]["sorted_frames"] > 100


@pytest.mark.parametrize("step_s", [-3600, -0.5, -1e9, 86_400, 1e9])
def test_a_clock_that_steps_is_said_and_survived(tmp_path, rows, step_s):
    half = len(rows) // 2
    stepped = candump(rows[:half]) + candump(rows[half:], epoch_ns=EPOCH_NS + round(step_s * 1e9))
    figures = replay(write(tmp_path / "bus.log", stepped), CONFIGURATION).figures
    clock = figures["log_clock"]
    assert (clock["steps_back"], clock["gaps_cut"]) == ((1, 0) if step_s < 0 else (0, 1))
    assert figures["seconds"] < 70.0
    assert any("clock" in note or "gap" in note for note in figures["notes"])


def test_one_wrong_stamp_is_one_wrong_stamp(tmp_path, rows, lines):
    k = len(rows) // 2
    for wrong in (0, EPOCH_NS + 10**18):
        mixed = lines.copy()
        mixed[k] = line(wrong, *rows[k][1:])
        figures = same(write(tmp_path / "bus.log", mixed), lines, tmp_path)
        assert figures["log_clock"]["wrong_stamps"] == 1


def test_a_gap_is_lived_through(tmp_path, rows):
    mute = [row for row in rows if row[1] in {272, 273, 768}]
    at = mute[2000][0]
    late = [(t if t < at else t + 7_000_000_000, can_id, data) for t, can_id, data in mute]
    figures, again = commands_of(write(tmp_path / "bus.log", candump(late)), tmp_path)
    assert figures["ticks"] == pytest.approx(TICKS + 3500, abs=2)
    changes = [change["after"] for change in figures["changes"] if change["damper"] == "front_left"]
    assert changes[:4] == ["ACTIVE", "SUBSTITUTE", "LIMP", "OFF"]
    assert changes[-1] == "ACTIVE"
    assert "000000000000" in {payload[4:] for payload in again[2000:]}


def test_one_interface_of_another_name_is_taken_and_said(tmp_path, rows, lines):
    path = write(tmp_path / "bus.log", candump(rows, channel="can3"))
    figures, again = commands_of_other(path, tmp_path)
    assert first_difference(again, expected(lines)) is None
    assert figures["interface"] == "can3"
    assert "no interface vcan0; can3 taken" in figures["notes"][0]


def commands_of_other(path, tmp_path, options=None):
    out = tmp_path / "out.log"
    figures = replay(path, CONFIGURATION, options, out=out).figures
    ours = [text for text in out.read_text().splitlines() if " 100#" in text]
    return figures, [text.split("#")[1] for text in ours]


def test_of_two_interfaces_one_is_chosen(tmp_path, rows, lines):
    other = candump([(at + 300, can_id, data) for at, can_id, data in rows], channel="can4")
    both = [text for pair in zip(candump(rows, channel="can3"), other, strict=True) for text in pair]
    path = write(tmp_path / "bus.log", both)
    with pytest.raises(InputError, match="can3, can4; choose with --interface"):
        replay(path, CONFIGURATION)
    figures, again = commands_of_other(path, tmp_path, Options(interface="can4"))
    assert first_difference(again, expected(lines)) is None
    assert figures["traffic"]["other_interfaces"] == len(rows)


def test_commands_that_differ_are_counted_and_measured(tmp_path, rows):
    changed = []
    seen = 0
    for at, can_id, data in rows:
        seen += can_id == 256
        if can_id == 256 and seen in {1000, 1100, 1200}:
            word = int.from_bytes(data, "little") ^ (0x40 << 12)  # 64 mA of the first damper
            changed.append((at, can_id, protected(word)))
        else:
            changed.append((at, can_id, data))
    figures = replay(write(tmp_path / "bus.log", candump(changed)), CONFIGURATION).figures
    assert figures["differences"] == 3
    assert figures["compared"]["largest_difference_a"] == pytest.approx(0.064)
    assert figures["compared"]["same_bytes"] == TICKS - 3


def protected(word):
    """A command with the judge's CRC."""
    data = bytearray(word.to_bytes(8, "little"))
    data[0] = expected_crc(bytes(data), bytes.fromhex("118E9609BB243CA3059A821DAF3028B7"))
    return bytes(data)


def test_a_log_that_begins_under_way_is_compared_once_settled(tmp_path):
    rows = [row for row in live(4000)[0] if row[0] > 1_234_567_000]
    figures = replay(write(tmp_path / "bus.log", candump(rows)), CONFIGURATION).figures
    assert figures["clock"] == "recorded"
    assert figures["compared"]["left_out_unsettled"] == 2000
    assert figures["compared"]["commands"] > 1000
    assert figures["differences"] == 0
    assert "ran before the log began" in " ".join(figures["notes"])


@pytest.mark.parametrize(
    "content",
    [b"", b"\n\n", b"no log at all\n", bytes(range(256)) * 20, b"(1.0) vcan0 7FF#00\n(1.1) vcan0 7FF#00\n"],
)
@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf", ".trc", ".mf4"])
def test_a_log_with_nothing_usable_is_one_line_and_status_2(tmp_path, capsys, content, suffix):
    path = tmp_path / f"bus{suffix}"
    path.write_bytes(content)
    out = tmp_path / "out.log"
    assert main(["replay", str(path), "-c", str(CONFIG), "-o", str(out), "--quiet"]) == 2
    error = [text for text in capsys.readouterr().err.splitlines() if not text.startswith("note: ")]
    assert len(error) == 1
    assert error[0].startswith(f"error: {path}: ")
    assert list(tmp_path.iterdir()) == [path]  # no half-written output


@pytest.mark.parametrize("name", ["none.log", "none.blf", "none.mf4", "."])
def test_a_log_that_is_not_there(tmp_path, capsys, name):
    assert main(["replay", str(tmp_path / name), "-c", str(CONFIG), "--quiet"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_json_has_what_the_interface_promises(tmp_path, capsys, lines):
    path = write(tmp_path / "bus.log", lines)
    assert main(["replay", str(path), "-c", str(CONFIG), "--json", "-"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert {"frames", "ticks", "commands", "rejected", "differences", "realtime_factor"} <= set(figures)
    assert figures["ticks"] == figures["commands"] == TICKS


@pytest.mark.parametrize("suffix", ["asc", "blf", "trc"])
def test_what_precedes_damage_is_replayed(tmp_path, rows, suffix):
    path = tmp_path / f"bus.{suffix}"
    with can.Logger(str(path)) as writer:
        for at, can_id, data in rows:
            stamp = (at + EPOCH_NS) / 1e9
            writer(can.Message(timestamp=stamp, arbitration_id=can_id, data=data, is_extended_id=False))
    whole = path.read_bytes()
    path.write_bytes(whole[: 2 * len(whole) // 3])
    figures = replay(path, CONFIGURATION).figures
    assert 0.3 * len(rows) < figures["frames"] < len(rows)
    assert figures["differences"] == 0


def test_a_gzip_that_is_cut_off_is_replayed_as_far_as_it_goes(tmp_path, lines):
    path = tmp_path / "bus.log.gz"
    packed = gzip.compress(("\n".join(lines) + "\n").encode())
    path.write_bytes(packed[: len(packed) // 2])
    figures = replay(path, CONFIGURATION).figures
    assert figures["rejected"].get("truncated_file") == 1
    assert figures["frames"] > 1000


def test_the_console_form_of_other_frames(tmp_path, rows, lines):
    text = console(rows, lambda at: micro(at + EPOCH_NS))
    stamp = text[100].split("  ")[0]
    text[100:100] = [
        f"{stamp}  {CHANNEL}  20000040   [8]  00 00 00 00 00 00 00 00   ERRORFRAME",
        f"{stamp}  {CHANNEL}  110   [0]  remote request",
        f"{stamp}  {CHANNEL}  RX - -  7FF   [2]  DE AD   '..'",
        f"{stamp}  {CHANNEL}  110  [12]  00 11 22 33 44 55 66 77 88 99 AA BB",
        f"{stamp}  {CHANNEL}  110   [8]  00 11",
    ]
    figures = same(write(tmp_path / "c.log", text), lines, tmp_path)
    assert figures["rejected"] == {"bad_line": 1, "error_frame": 1, "fd_frame": 1, "remote_frame": 1}
    assert figures["traffic"]["foreign"] == 1
    assert figures["traffic"]["bus_off"] == 1


@pytest.mark.parametrize("start", ["0", "nan", "inf", "-1e300", "1700000100"])
def test_a_start_far_from_the_log_is_refused(tmp_path, capsys, lines, start):
    path = write(tmp_path / "bus.log", lines[:500])
    arguments = ["-c", str(CONFIG), "--clock", "grid", "--quiet"]
    assert main(["replay", str(path), *arguments, f"--start={start}"]) == 2
    assert "far from a start" in capsys.readouterr().err


def test_without_commands_there_is_no_recorded_clock(tmp_path, capsys, lines):
    sent = set(sent_lines(lines))
    path = write(tmp_path / "bus.log", [text for text in lines if text not in sent])
    assert main(["replay", str(path), "-c", str(CONFIG), "--clock", "recorded", "--quiet"]) == 2
    assert "--clock grid" in capsys.readouterr().err
