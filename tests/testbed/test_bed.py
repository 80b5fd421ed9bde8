"""The bed itself: a script gets a real bus, its failures are seen, and nothing of it survives."""

from __future__ import annotations

import time
from pathlib import Path

import buslog
import pytest
from bed import Bed, BedError, Result

pytestmark = pytest.mark.testbed


SEND_WITH_PYTHON = """
import sys
sys.modules["asammdf"] = None  # python-can would import it, and pandas with it: 8 s in the guest
import can

with can.Bus("vcan0", interface="socketcan") as bus:
    for line in open("frames.txt"):
        can_id, data = line.split()
        bus.send(can.Message(arbitration_id=int(can_id, 16), data=bytes.fromhex(data), is_extended_id=False))
"""


@pytest.fixture(scope="module")
def sent() -> list[tuple[int, bytes]]:
    """A hundred frames of the project's DBC."""
    message = buslog.dbc().get_message_by_name("RelativeVelocity")
    rest = dict.fromkeys((signal.name for signal in message.signals), 0)
    return [
        (message.frame_id, message.encode(rest | {"RelVel_FL": 0.01 * n, "RelVel_RR": -0.01 * n}))
        for n in range(100)
    ]


@pytest.fixture(scope="module")
def tour(bus: Bed, sent: list[tuple[int, bytes]]) -> Result:
    """One script for several tests, as every start of Python costs seconds in the guest."""
    script = """
        record
        sleep 0.5
        "$PYTHON" send.py
        mark sent
        cansend vcan0 110#R8
        cansend vcan0 00000110#0102
        sleep 0.2
        ip link set vcan0 down
        mark down
        ! cansend vcan0 110#03 || exit 3
        ip link set vcan0 up
        mark up
        cansend vcan0 110#04
        sleep 0.5
        end "$recorder"
        """
    frames = "".join(f"{can_id:X} {data.hex()}\n" for can_id, data in sent)
    return bus.run(script, files={"send.py": SEND_WITH_PYTHON, "frames.txt": frames}).checked()


def test_candump_sees_what_python_can_sends_and_cantools_decodes_it(
    tour: Result, sent: list[tuple[int, bytes]]
) -> None:
    frames = buslog.read(tour.read("bus.log"))[: len(sent)]
    assert [(frame.can_id, frame.data) for frame in frames] == sent
    speeds = [buslog.decode(frame)["RelVel_FL"] for frame in frames]
    assert speeds == pytest.approx([0.01 * n for n in range(100)], abs=0.00025)


def test_remote_and_extended_frames_travel_as_what_they_are(
    tour: Result, sent: list[tuple[int, bytes]]
) -> None:
    remote, extended = buslog.read(tour.read("bus.log"))[len(sent) : len(sent) + 2]
    assert remote.can_id == 0x110
    assert remote.data is None
    assert (extended.can_id, extended.extended, extended.data) == (0x110, True, b"\x01\x02")


def test_an_interface_that_is_down_carries_nothing_and_works_again_after_up(
    tour: Result, sent: list[tuple[int, bytes]]
) -> None:
    frames = buslog.read(tour.read("bus.log"))[len(sent) + 2 :]
    times = buslog.marks(tour.read("marks"))
    assert [frame.data for frame in frames] == [b"\x04"]
    assert times["sent"] < times["down"] < times["up"] < frames[0].time_s


def test_a_failing_script_is_seen_with_all_it_said(bus: Bed) -> None:
    result = bus.run("echo heard; echo seen >&2; false; echo never")
    assert (result.returncode, result.stdout, result.stderr) == (1, "heard\n", "seen\n")
    with pytest.raises(AssertionError, match="exited 1"):
        result.checked()


def test_a_hung_script_is_ended_with_status_124_and_leaves_no_process(bus: Bed) -> None:
    start_s = time.monotonic()
    result = bus.run("sleep 4321 & echo before; sleep 4322", timeout_s=5.0)
    assert (result.returncode, result.stdout) == (124, "before\n")
    assert "sleep 4321" in result.stderr
    assert time.monotonic() - start_s < 30
    left = bus.run("cat /proc/[0-9]*/cmdline | tr '\\0' ' '")
    assert "432" not in left.checked().stdout


def test_a_program_that_forgets_a_signal_is_ended_all_the_same(bus: Bed) -> None:
    forgets = """bash -c 'trap "trap - TERM" TERM; while :; do sleep 0.1; done' & program=$!"""
    result = bus.run(f"{forgets}\nsleep 1\nend $program\nkill -0 $program || echo gone", timeout_s=30.0)
    assert result.checked().stdout == "gone\n"


def test_no_script_has_to_wait_for_what_it_left_behind(bus: Bed) -> None:
    """Only what is no child of the script can be none of its children that it waits for."""
    result = bus.run('(sleep 4321 & echo $! >left)\nread -r left <left\nps -o ppid= -p "$left"; echo $$')
    parent, script = result.checked().stdout.split()
    assert parent != script


def test_every_script_has_a_bus_of_its_own(bus: Bed) -> None:
    (first, second) = (
        bus.run("ip link set vcan0 down; ip -br link").checked(),
        bus.run("ip -br link").checked(),
    )
    assert "vcan0            DOWN" in first.stdout
    assert "vcan0            UNKNOWN" in second.stdout


def test_a_guest_that_dies_is_reported_and_replaced(guest: Bed) -> None:
    with pytest.raises(BedError, match="guest ended"):
        guest.run("poweroff -f", machine=True)
    assert guest.run("echo back", machine=True).checked().stdout == "back\n"


def test_the_guest_writes_no_file_of_the_host_outside_its_directory(guest: Bed, tmp_path: Path) -> None:
    (tmp_path / "kept").write_text("host")
    script = f"echo guest >{tmp_path}/kept; echo guest >{tmp_path}/new; cat {tmp_path}/kept {tmp_path}/new"
    assert guest.run(script, machine=True).checked().stdout == "guest\nguest\n"
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("kept", "host")]
