"""Faults of frames and values on a real bus: what the daemon makes of each, in time, named, unaided back.

What is sent, and what must come of it: frame_faults.py. Faults of link, process, clock, files and disk:
test_faults.py. The same and more on a clock of its own, to the tick: tests/runtime/test_faults.py.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from typing import Any

import buslog
import pytest
from bed import Bed, Result
from frame_faults import BEGIN_ID, END_ID, FRAMES, PARTS, RATE_HZ, SIGNALS, FrameFault, recording
from vehicle import CONFIG, DAMPERS, guest_files, violations

pytestmark = pytest.mark.testbed

SCRIPT = """
candump -D -L -r 4194304 vcan0 >bus.log 2>candump.err & recorder=$!
nice -n -10 "$PYTHON" -m mrctl run -c vehicle.yaml >daemon.log 2>&1 & daemon=$!
running() { grep -q '"event": "realtime"' daemon.log; }
wait_for 120 running
nice -n -10 canplayer -I car.log
kill -TERM "$daemon"
status=0
wait "$daemon" || status=$?
echo "$status" >daemon.status
kill "$recorder"
wait || true
"""
TICK_S = 1.0 / CONFIG["loop"]["rate_hz"]
CYCLE_S = 1.0 / RATE_HZ
CASES = [(number, k) for number in range(len(PARTS)) for k in range(4)]
NAMES = [f"{PARTS[number][k]}-{DAMPERS[k]}" for number, k in CASES]


@pytest.fixture(scope="module")
def drive(bus: Bed) -> Result:
    files = guest_files(SIGNALS, FRAMES) | {"car.log": recording()}
    return bus.run(SCRIPT, files=files, timeout_s=400).checked()


@pytest.fixture(scope="module")
def log(drive: Result) -> list[dict[str, Any]]:
    """What the daemon said, each line with the time in s on the recording's clock."""
    lines = [json.loads(line) for line in drive.read("daemon.log").splitlines()]
    return [line | {"time_s": datetime.fromisoformat(line["timestamp"]).timestamp()} for line in lines]


@dataclass(frozen=True)
class Part:
    """What came of one part's faults: times in s, (time, state of each damper) from its begin to the next.

    held_up_s: for how long, at most, the guest kept the controller from its work; it is late by as much.
    """

    begin_s: float
    end_s: float
    over_s: float
    states: list[tuple[float, list[str]]]
    held_up_s: float


@pytest.fixture(scope="module")
def parts(drive: Result) -> list[Part]:
    frames = buslog.read(drive.read("bus.log"))
    at = {
        name: [f.time_s for f in frames if f.can_id == name and not f.extended] for name in (BEGIN_ID, END_ID)
    }
    assert len(at[BEGIN_ID]) == len(at[END_ID]) == len(PARTS)
    told = [(f.time_s, buslog.states(f)) for f in buslog.named(frames, "ControllerState")]
    commands = [f.time_s for f in buslog.named(frames, "CurrentCommand")]
    last_car_s = buslog.named(frames, "RelativeVelocity")[-1].time_s
    out = []
    for begin_s, end_s, over_s in zip(at[BEGIN_ID], at[END_ID], [*at[BEGIN_ID][1:], last_car_s], strict=True):
        gaps = [b - a for a, b in pairwise(commands) if begin_s - 0.1 <= a and b <= over_s + 0.1]
        states = [(time_s, own) for time_s, own in told if begin_s <= time_s <= over_s]
        out.append(Part(begin_s, end_s, over_s, states, max(gaps) - CYCLE_S))
    return out


@pytest.fixture(params=CASES, ids=NAMES)
def case(request: pytest.FixtureRequest, parts: list[Part]) -> tuple[FrameFault, int, Part]:
    number, k = request.param
    return PARTS[number][k], k, parts[number]


def test_every_damper_has_every_fault() -> None:
    had = [{str(part[k]) for part in PARTS} for k in range(4)]
    assert len(had[0]) >= 20
    assert had == [had[0]] * 4


def test_the_defined_state_is_reached_within_the_time_out_and_left_unaided(
    case: tuple[FrameFault, int, Part],
) -> None:
    fault, k, part = case
    course = [(time_s, states[k]) for time_s, states in part.states]
    during = [(time_s, state) for time_s, state in course if time_s <= part.end_s]
    if fault.cause:
        reached_s, state = next((t, s) for t, s in during if s != "ACTIVE")
        assert state == "SUBSTITUTE"
        # One cycle more until the state is said.
        assert reached_s - part.begin_s <= fault.within_s + TICK_S + CYCLE_S + part.held_up_s
    elif part.held_up_s < fault.within_s:  # else the guest made it a loss of frames
        assert {state for _, state in during} == {"ACTIVE"}
    if fault.then_limp:
        assert during[-1][1] == "LIMP"
    assert course[-1][1] == "ACTIVE"


def test_the_log_names_the_cause(case: tuple[FrameFault, int, Part], log: list[dict[str, Any]]) -> None:
    fault, k, part = case
    lines = [line for line in log if part.begin_s <= line["time_s"] <= part.over_s]
    causes = [
        line["cause"]
        for line in lines
        if line["event"] == "state" and line["after"] == "SUBSTITUTE" and DAMPERS[k] in line["dampers"]
    ]
    if fault.cause:
        assert causes[0] == fault.cause
    if fault.counted:  # said once a second
        late_s = part.end_s + 1.5 + part.held_up_s
        said = [line for line in log if part.begin_s <= line["time_s"] <= late_s]
        assert any(line.get(fault.counted) for line in said if line["event"] == "rejected frames")


def test_the_independent_judge_finds_nothing(drive: Result) -> None:
    assert not violations(drive)


def test_the_end_is_clean_and_nothing_but_lines_of_the_log_was_said(
    drive: Result, log: list[dict[str, Any]]
) -> None:
    assert drive.read("daemon.status") == "0\n"
    assert log[-1]["event"] == "stopped"
