"""Faults of link, process, clock, files and disk on a real bus; those of frames: tests/runtime/faults.py.

One drive goes through them one after another. Each is judged by what came after it on the bus, by line of the
recording and not by time, which one of the faults changes, and by what the daemon's log says.
"""

from __future__ import annotations

import json
import re
from itertools import pairwise
from typing import Any

import buslog
import pytest
from bed import Bed, Result
from buslog import Frame
from steady import steady
from vehicle import (
    ALL_ACTIVE,
    CALIBRATION,
    CURRENT_MAX_A,
    DAMPERS,
    SILENT_OFF_S,
    STALE_AFTER_S,
    car_files,
    guest_files,
    violations,
)

pytestmark = pytest.mark.testbed

OTHER_CALIBRATION = CALIBRATION.replace("values: [290.0, 530.0, 760.0,", "values: [290.0, 500.0, 700.0,")
BROKEN_CALIBRATION = CALIBRATION.replace("values: [290.0, 530.0,", "values: [530.0, 290.0,")
FLOOD = 20_000
INPUTS = ("RelativeVelocity", "BodyVelocity", "CaseTemperature")

SCRIPT = """
start_car() { apart 1 "$PYTHON" -S car.py 2>>car.log & car=$!; }
lines() { wc -l <bus.log; }
begin() { echo "$1 $(lines) $(wc -l <daemon.log)" >>begins; }
back() { local from; from=$(lines); wait_for 60 controls_after "$from"; sleep 0.5; }
says() { tail -n "+$(($1 + 1))" daemon.log | grep -q "$2"; }

: >daemon.log
record
nice -n -10 "$PYTHON" -m mrctl run -c vehicle.yaml >>daemon.log 2>&1 & daemon=$!
start_car
wait_for 120 controls_after 0

begin clock
date -s '+1 hour' >date.log
sleep 1.5
date -s '-1 hour' >>date.log
back

begin stop
kill -STOP "$daemon"
sleep 3
kill -CONT "$daemon"
back

begin overflow
kill -STOP "$daemon"
cangen vcan0 -I 110 -L 8 -D 0011223344556677 -g 0 -i -n "$FLOOD"
kill -CONT "$daemon"
back

begin enobufs
insmod "/usr/lib/uml/modules/$(uname -r)/kernel/net/sched/sch_tbf.ko" || true
tc qdisc add dev vcan0 root tbf rate 1kbit burst 64 limit 64
sleep 2
tc qdisc del dev vcan0 root
back

begin deleted
before=$(wc -l <daemon.log)
ip link del vcan0
wait_for 20 says "$before" link_gone
sleep 1
end "$recorder"
ip link add vcan0 type vcan
ip link set vcan0 up
record
wait_for 20 says "$before" link_up
back

begin dead
before=$(wc -l <daemon.log)
kill -KILL "$car"
wait_for 30 says "$before" BUS_SILENT
sleep 0.5
start_car
back

begin replaced
before=$(wc -l <daemon.log)
cp other.yaml calibration.yaml
kill -HUP "$daemon"
wait_for 60 says "$before" 'calibration taken over'
sleep 0.5

begin broken
before=$(wc -l <daemon.log)
cp broken.yaml calibration.yaml
kill -HUP "$daemon"
wait_for 60 says "$before" 'calibration kept'
sleep 0.5

begin term
kill -TERM "$daemon"
status=0
wait "$daemon" || status=$?
echo "$status" >daemon.status
sleep 0.5

# A disk with no room for the log, and then with room again.
cp original.yaml calibration.yaml
mkdir disk
mount -t tmpfs -o size=8k tmpfs disk
head -c 8192 /dev/zero >disk/full || true
begin disk
nice -n -10 "$PYTHON" -m mrctl run -c vehicle.yaml 2>disk/daemon.log & daemon=$!
from=$(lines)
wait_for 60 controls_after "$from"
rm disk/full
kill -TERM "$daemon"
wait "$daemon" || status=$?
echo "$status" >disk.status
cp disk/daemon.log disk.log
umount disk
end "$car" "$recorder"
"""

FAULTS = ("clock", "stop", "overflow", "enobufs", "deleted", "dead", "replaced", "broken", "term", "disk")


@pytest.fixture(scope="module")
def drive(bus: Bed) -> Result:
    files = {
        **guest_files(),
        **car_files(),
        "original.yaml": CALIBRATION,
        "other.yaml": OTHER_CALIBRATION,
        "broken.yaml": BROKEN_CALIBRATION,
    }
    settings = f"ALL_ACTIVE='{ALL_ACTIVE}' FLOOD={FLOOD}\n"
    return steady(bus, settings + SCRIPT, files, timeout_s=400)


@pytest.fixture(scope="module")
def begins(drive: Result) -> dict[str, tuple[int, int]]:
    """Where each fault begins: line of the recording, line of the log."""
    words = [line.split() for line in drive.read("begins").splitlines()]
    return {name: (int(frames), int(log)) for name, frames, log in words}


@pytest.fixture(scope="module")
def frames(drive: Result) -> list[Frame]:
    return buslog.read(drive.read("bus.log"))


@pytest.fixture(scope="module")
def log(drive: Result) -> list[dict[str, Any]]:
    return [json.loads(line) for line in drive.read("daemon.log").splitlines()]


def during(fault: str, begins: dict[str, tuple[int, int]], lines: list[Any], which: int) -> list[Any]:
    """The lines from a fault's beginning to the next one's."""
    start = begins[fault][which]
    follows = FAULTS.index(fault) + 1
    return lines[start : begins[FAULTS[follows]][which] if follows < len(FAULTS) else None]


def held_up(recorded: list[Frame]) -> list[tuple[float, float]]:
    """From command to command, s, where the controller was held up: frames may have waited too long."""
    times = [recorded[0].time_s, *(frame.time_s for frame in buslog.named(recorded, "CurrentCommand"))]
    return [(earlier, later) for earlier, later in pairwise(times) if later - earlier > STALE_AFTER_S / 2]


@pytest.mark.parametrize("fault", FAULTS[:-2])
def test_after_each_fault_every_damper_is_active_again(
    fault: str, begins: dict[str, tuple[int, int]], frames: list[Frame]
) -> None:
    states = buslog.named(during(fault, begins, frames, 0), "ControllerState")
    assert set(buslog.states(states[-1])) == {"ACTIVE"}


def test_every_command_is_right_and_in_range_whatever_happens(frames: list[Frame]) -> None:
    commands = buslog.named(frames, "CurrentCommand")
    assert len(commands) > 500
    assert all(buslog.e2e_is_right(frame) for frame in commands)
    assert all(0.0 <= current <= CURRENT_MAX_A for frame in commands for current in buslog.currents(frame))


def test_the_independent_judge_finds_nothing_but_commands_that_the_bus_did_not_take(
    drive: Result, begins: dict[str, tuple[int, int]], frames: list[Frame]
) -> None:
    full = [frame.time_s for frame in during("enobufs", begins, frames, 0)]
    found = violations(drive)
    assert not [v for v in found if v.rule != "counter" or not full[0] <= v.time_s <= full[-1]]


def test_a_step_of_the_wall_clock_touches_nothing(
    begins: dict[str, tuple[int, int]], frames: list[Frame], log: list[dict[str, Any]]
) -> None:
    recorded = during("clock", begins, frames, 0)
    states = {tuple(buslog.states(frame)) for frame in buslog.named(recorded, "ControllerState")}
    assert states == {("ACTIVE",) * 4}
    counters = list(buslog.counters(buslog.named(recorded, "CurrentCommand")))
    assert all((b - a) % 16 == 1 for a, b in pairwise(counters))
    times = [frame.time_s for frame in recorded]
    assert max(times) - min(times) > 3000.0  # the clock did step
    events = {line["event"] for line in during("clock", begins, log, 1)}
    assert "state" not in events
    # A busy machine may hold the controller up until frames do go stale: its commands then show it.
    gaps = [later - earlier for earlier, later in held_up(recorded) if later - earlier < 3000.0]
    assert "frames_stale" not in events or gaps


def test_a_stopped_controller_goes_on_with_fresh_frames_only(
    begins: dict[str, tuple[int, int]], frames: list[Frame], log: list[dict[str, Any]]
) -> None:
    recorded = during("stop", begins, frames, 0)
    commands = [frame.time_s for frame in buslog.named(recorded, "CurrentCommand")]
    stopped, went_on = max(pairwise(commands), key=lambda two: two[1] - two[0])
    assert went_on - stopped > 2.0
    came = [frame.time_s for name in INPUTS for frame in buslog.named(recorded, name)]
    stale = [line for line in during("stop", begins, log, 1) if line["event"] == "frames_stale"]
    thrown = sum(int(re.findall(r"(\d+) frames", line["detail"])[0]) for line in stale)
    # All that came during the stop, but for the last moment before it went on, whose frames are fresh.
    assert sum(stopped + 0.1 < at < went_on - 0.3 for at in came) <= thrown
    # And nothing but what came while it was held up: by the stop, or by a busy machine before or after.
    gaps = held_up(recorded)
    assert thrown <= sum(any(earlier - 0.1 < at < later for earlier, later in gaps) for at in came)


def test_frames_that_the_buffer_lost_are_counted_in_the_log(
    begins: dict[str, tuple[int, int]], log: list[dict[str, Any]]
) -> None:
    lines = during("overflow", begins, log, 1)
    # Once, or in parts where a busy machine lets the controller read in between.
    dropped = [int(line["detail"].split()[1]) for line in lines if line["event"] == "frames_dropped"]
    assert 1000 < sum(dropped) < FLOOD
    assert any(line["event"] == "frames_stale" for line in lines)


def test_a_full_send_queue_is_said_once_and_once_that_it_is_over(
    begins: dict[str, tuple[int, int]], log: list[dict[str, Any]]
) -> None:
    lines = during("enobufs", begins, log, 1)
    events = [line["event"] for line in lines if line["event"].startswith("send_")]
    assert events[0] == "send_refused"
    assert events[-1] == "send_resumed"
    assert any("buffer" in line["detail"].lower() for line in lines if line["event"] == "send_refused")


def test_a_removed_interface_is_named_and_bound_again(
    begins: dict[str, tuple[int, int]], log: list[dict[str, Any]]
) -> None:
    lines = during("deleted", begins, log, 1)
    events = [line["event"] for line in lines if line["event"].startswith("link_")]
    # It may be seen to go down before it is seen to be gone.
    assert [event for event in events if event != "link_down"] == ["link_gone", "link_back", "link_up"]


def test_a_dead_car_is_left_without_current_in_the_end(
    begins: dict[str, tuple[int, int]], frames: list[Frame], log: list[dict[str, Any]]
) -> None:
    changes = [line for line in during("dead", begins, log, 1) if line["event"] == "state"]
    courses = {damper: [c["after"] for c in changes if damper in c["dampers"]] for damper in DAMPERS}
    for course in courses.values():
        assert course[:3] == ["SUBSTITUTE", "LIMP", "OFF"]
        assert course[-1] == "ACTIVE"
    assert {c["cause"] for c in changes} >= {"RELATIVE_VELOCITY_MISSING", "BUS_SILENT"}
    recorded = during("dead", begins, frames, 0)
    off = [f for f in buslog.named(recorded, "ControllerState") if "OFF" in buslog.states(f)]
    between = buslog.between(buslog.named(recorded, "CurrentCommand"), off[-1].time_s - 0.1, off[-1].time_s)
    assert {tuple(buslog.currents(frame)) for frame in between} == {(0.0,) * 4}
    assert off[-1].time_s - recorded[0].time_s >= SILENT_OFF_S


def test_a_replaced_calibration_is_taken_over_without_a_missed_command(
    begins: dict[str, tuple[int, int]], frames: list[Frame], log: list[dict[str, Any]]
) -> None:
    lines = [line for line in during("replaced", begins, log, 1) if line["event"].startswith("calibration")]
    (line,) = lines
    assert line["event"] == "calibration taken over"
    recorded = during("replaced", begins, frames, 0)
    assert {tuple(buslog.states(f)) for f in buslog.named(recorded, "ControllerState")} == {("ACTIVE",) * 4}
    counters = list(buslog.counters(buslog.named(recorded, "CurrentCommand")))
    assert all((b - a) % 16 == 1 for a, b in pairwise(counters))


def test_a_broken_calibration_is_refused_with_its_line_and_the_old_one_kept(
    begins: dict[str, tuple[int, int]], frames: list[Frame], log: list[dict[str, Any]]
) -> None:
    (line,) = [line for line in during("broken", begins, log, 1) if line["event"].startswith("calibration")]
    assert line["event"] == "calibration kept"
    assert "calibration.yaml:" in line["refused"]
    recorded = during("broken", begins, frames, 0)
    assert {tuple(buslog.states(f)) for f in buslog.named(recorded, "ControllerState")} == {("ACTIVE",) * 4}


def test_a_full_disk_costs_log_lines_and_nothing_else(drive: Result) -> None:
    assert drive.read("disk.status") == "0\n"
    lines = [json.loads(line) for line in drive.read("disk.log").splitlines() if line.startswith("{")]
    assert lines[0]["event"] == "log lines lost"
    assert lines[0]["lines_lost"] >= 2
    assert lines[-1]["event"] == "stopped"


def test_the_end_is_clean_and_no_line_is_anything_but_json(drive: Result, log: list[dict[str, Any]]) -> None:
    assert drive.read("daemon.status") == "0\n"
    assert log[-1]["event"] == "stopped"
    assert log[-1]["at_rest"] is True
