"""Faults of frames and values on a real bus: what the daemon makes of each, in time, named, unaided back.

What is sent, and what must come of it: frame_faults.py. Faults of link, process, clock, files and disk:
test_system_faults.py. The same and more on a clock of its own, to the tick: tests/runtime/test_faults.py.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from typing import Any

import buslog
import pytest
from bed import Bed, Result
from frame_faults import (
    BEGIN_ID,
    BODY,
    END_ID,
    FRAMES,
    GOOD_S,
    PARTS,
    RATE_HZ,
    SIGNALS,
    TIMEOUT_MS,
    VELOCITY,
    FrameFault,
    recording,
)
from vehicle import DAMPERS, LOOP_HZ, guest_files, violations

pytestmark = pytest.mark.testbed

SCRIPT = """
record
nice -n -10 "$PYTHON" -m mrctl run -c vehicle.yaml >daemon.log 2>&1 & daemon=$!
running() { grep -q '"event": "realtime"' daemon.log; }
wait_for 120 running
(apart 1 canplayer -I car.log)
kill -TERM "$daemon"
status=0
wait "$daemon" || status=$?
echo "$status" >daemon.status
end "$recorder"
"""
TICK_S = 1.0 / LOOP_HZ
CYCLE_S = 1.0 / RATE_HZ
CASES = [(number, k) for number in range(len(PARTS)) for k in range(4)]
NAMES = [f"{PARTS[number][k]}-{DAMPERS[k]}" for number, k in CASES]


DRIVES, DRIVEN_S = 6, 360.0  # at most, and no further one after that time
HELD_UP_S = min(TIMEOUT_MS.values()) / 1000.0 - 0.1


@dataclass(frozen=True)
class Part:
    """What came of one part's faults: times in s, (time, state of each damper) from its begin to the next.

    held_up_s: for how long, at most, the guest kept car or controller from their work; states come late by as
    much.
    log: what the daemon said in the whole drive, each line with the time in s on the recording's clock.
    """

    begin_s: float
    end_s: float
    over_s: float
    states: list[tuple[float, list[str]]]
    held_up_s: float
    log: list[dict[str, Any]]

    @property
    def is_disturbed(self) -> bool:
        """A guest that stands still for as long as a time-out makes a loss of frames of any other fault."""
        return self.held_up_s > HELD_UP_S


@dataclass(frozen=True)
class Case:
    """One damper's fault in a part."""

    fault: FrameFault
    k: int
    part: Part

    @property
    def excuse(self) -> str:
        """Why nothing that fails is a finding: no drive was better."""
        still = f"the guest stood still for {self.part.held_up_s:.1f} s"
        return still if self.part.is_disturbed else ""


@pytest.fixture(scope="module")
def outcome(bus: Bed) -> tuple[list[Result], dict[int, Part]]:
    """The drives, and of each of PARTS what came of it; parts that were disturbed are driven again."""
    drives: list[Result] = []
    parts: dict[int, Part] = {}
    left = list(range(len(PARTS)))
    until_s = time.monotonic() + DRIVEN_S
    while left and len(drives) < DRIVES and time.monotonic() < until_s:
        files = guest_files(SIGNALS, FRAMES) | {"car.log": recording(left)}
        drives.append(bus.run(SCRIPT, files=files, timeout_s=400).checked())
        parts |= zip(left, parts_of(drives[-1], len(left)), strict=True)
        left = [number for number in left if parts[number].is_disturbed]
    return drives, parts


def parts_of(drive: Result, count: int) -> list[Part]:
    frames = buslog.read(drive.read("bus.log"))
    at = {
        name: [f.time_s for f in frames if f.can_id == name and not f.extended] for name in (BEGIN_ID, END_ID)
    }
    assert len(at[BEGIN_ID]) == len(at[END_ID]) == count
    log = [json.loads(line) for line in drive.read("daemon.log").splitlines()]
    log = [line | {"time_s": datetime.fromisoformat(line["timestamp"]).timestamp()} for line in log]
    told = [(f.time_s, buslog.states(f)) for f in buslog.named(frames, "ControllerState")]
    # In each part the car goes on with at least one of the two.
    of_car = {buslog.dbc().get_message_by_name(name).frame_id for name in (VELOCITY, BODY)}
    works = [
        [f.time_s for f in buslog.named(frames, "CurrentCommand")],
        [f.time_s for f in frames if f.can_id in of_car],
    ]
    last_car_s = buslog.named(frames, "RelativeVelocity")[-1].time_s
    out = []
    for begin_s, end_s, over_s in zip(at[BEGIN_ID], at[END_ID], [*at[BEGIN_ID][1:], last_car_s], strict=True):
        # Also such as outlasted the part, or came so late before it that good frames may not have mended it.
        before_s = begin_s - GOOD_S / 2
        gaps = [b - a for work in works for a, b in pairwise(work) if a < over_s and b > before_s]
        states = [(time_s, own) for time_s, own in told if begin_s <= time_s <= over_s]
        out.append(Part(begin_s, end_s, over_s, states, max(gaps) - CYCLE_S, log))
    return out


@pytest.fixture(params=CASES, ids=NAMES)
def case(request: pytest.FixtureRequest, outcome: tuple[list[Result], dict[int, Part]]) -> Case:
    number, k = request.param
    return Case(PARTS[number][k], k, outcome[1][number])


def test_every_damper_has_every_fault() -> None:
    had = [{str(part[k]) for part in PARTS} for k in range(4)]
    assert len(had[0]) >= 20
    assert had == [had[0]] * 4


def test_the_defined_state_is_reached_within_the_time_out_and_left_unaided(case: Case) -> None:
    fault, k, part = case.fault, case.k, case.part
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


def test_the_log_names_the_cause(case: Case) -> None:
    fault, k, part = case.fault, case.k, case.part
    lines = [line for line in part.log if part.begin_s <= line["time_s"] <= part.over_s]
    causes = [
        line["cause"]
        for line in lines
        if line["event"] == "state" and line["after"] == "SUBSTITUTE" and DAMPERS[k] in line["dampers"]
    ]
    if fault.cause:
        assert causes[0] == fault.cause
    if fault.counted:  # said once a second
        late_s = part.end_s + 1.5 + part.held_up_s
        said = [line for line in part.log if part.begin_s <= line["time_s"] <= late_s]
        assert any(line.get(fault.counted) for line in said if line["event"] == "rejected frames")


def test_the_independent_judge_finds_nothing(outcome: tuple[list[Result], dict[int, Part]]) -> None:
    for drive in outcome[0]:
        assert not violations(drive)


def test_the_end_is_clean_and_nothing_but_lines_of_the_log_was_said(
    outcome: tuple[list[Result], dict[int, Part]],
) -> None:
    drives, parts = outcome
    assert all(drive.read("daemon.status") == "0\n" for drive in drives)
    assert all(part.log[-1]["event"] == "stopped" for part in parts.values())
