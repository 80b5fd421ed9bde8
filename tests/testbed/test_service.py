"""The systemd unit on a real systemd: started, killed, hung, stopped; it leaves 0 A and comes back."""

from __future__ import annotations

import json
import os
import re
import subprocess
from itertools import pairwise
from pathlib import Path

import buslog
import pytest
from bed import CHECKOUT, Bed, Result
from steady import steady
from vehicle import ALL_ACTIVE, car_files, guest_files, violations

pytestmark = pytest.mark.testbed

UNIT = CHECKOUT / "systemd" / "mrctl.service"
TEMPLATE = CHECKOUT / "systemd" / "mrctl@.service"

# Kills from outside, and ticks that hang until the watchdog kills; more of these from the environment:
# MRCTL_WATCHDOG_KILLS=20 pytest tests/testbed/test_service.py
FAULTS = ("KILL1", *(f"STOP{k}" for k in range(1, 1 + int(os.environ.get("MRCTL_WATCHDOG_KILLS", "1")))))

# Time in the guest is not real time. The second ExecStopPost= notes when the unit's own one is over.
DROP_IN = """
[Service]
WatchdogSec=3s
TimeoutStartSec=90s
TimeoutStopSec=20s
ExecStopPost=+/bin/bash -c 'date +%%s.%%N >>"{job}/stop_post_ends"'
"""

SCRIPT = """
unit=/etc/systemd/system/mrctl.service
mkdir -p $unit.d /etc/mrctl
cp vehicle.yaml calibration.yaml mrctl.dbc /etc/mrctl/
cp "$MRCTL_UNIT" $unit
sed "s#{job}#$PWD#" drop_in >$unit.d/guest.conf
systemctl daemon-reload

record
apart 1 "$PYTHON" -S car.py 2>car.log & car=$!
trap 'systemctl stop mrctl; journalctl -u mrctl --no-pager >journal.log
  journalctl -u mrctl --no-pager -o json >journal.json; end "$car" "$recorder"' EXIT

main_pid() { systemctl show -P MainPID mrctl; }
controls() { tail -n 60 bus.log | grep -qE "$ALL_ACTIVE"; }
# In this order: the old process may die between the two questions.
is_back() {
  local pid
  pid=$(main_pid)
  [ "$pid" != 0 ] && [ "$pid" != "$1" ] && systemctl is-active --quiet mrctl
}

systemctl start mrctl
mark started
systemctl show mrctl >started.show
cat "/proc/$(main_pid)/status" >started.status
chrt -p "$(main_pid)" >started.policy
wait_for 60 controls
mark active

reloaded() { journalctl -u mrctl --no-pager | grep -q 'calibration taken over'; }
systemctl reload mrctl
wait_for 60 reloaded
mark reloaded
sleep 0.5

for fault in $FAULTS; do
  pid=$(main_pid)
  mark "$fault"
  kill "-${fault%%[0-9]*}" "$pid"
  wait_for 90 is_back "$pid"
  mark "back_$fault"
  sleep 0.5
  wait_for 60 controls
  mark "active_$fault"
done

mark stopping
systemctl stop mrctl
mark stopped
sleep 0.5
"""


@pytest.fixture(scope="module")
def life(guest: Bed) -> Result:
    """One life of the service; the tests read what it left."""
    files = guest_files() | car_files() | {"drop_in": DROP_IN}
    script = f"MRCTL_UNIT='{UNIT}' ALL_ACTIVE='{ALL_ACTIVE}' FAULTS='{' '.join(FAULTS)}'\n{SCRIPT}"
    return steady(guest, script, files, timeout_s=240 + 60 * len(FAULTS), machine=True)


def properties(text: str) -> dict[str, str]:
    return dict(line.split("=", 1) for line in text.splitlines() if "=" in line)


def journal_lines(life: Result, event: str) -> list[dict[str, str]]:
    """The daemon's own lines of one kind, as the journal's fields."""
    lines = [json.loads(line) for line in life.read("journal.json").splitlines()]
    return [line for line in lines if line.get("MRCTL_EVENT") == event]


def test_the_service_is_active_once_the_daemon_says_ready(life: Result) -> None:
    shown = properties(life.read("started.show"))
    assert (shown["ActiveState"], shown["SubState"], shown["NRestarts"]) == ("active", "running", "0")
    assert shown["StatusText"]


def test_the_service_runs_without_any_right_and_at_its_priority(life: Result) -> None:
    status = dict(line.split(":\t", 1) for line in life.read("started.status").splitlines() if ":\t" in line)
    assert {status[name] for name in ("CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb")} == {"0" * 16}
    assert (status["NoNewPrivs"], status["Seccomp"]) == ("1", "2")
    assert "0" not in status["Uid"].split()
    assert "SCHED_FIFO" in life.read("started.policy")
    assert "priority: 40" in life.read("started.policy")


def test_a_reload_takes_the_calibrations_over_without_a_missed_command(life: Result) -> None:
    (line,) = journal_lines(life, "calibration taken over")
    assert line["MRCTL_CALIBRATIONS"]
    times = buslog.marks(life.read("marks"))
    frames = buslog.between(buslog.read(life.read("bus.log")), times["active"], times["reloaded"])
    assert {tuple(buslog.states(f)) for f in buslog.named(frames, "ControllerState")} == {("ACTIVE",) * 4}
    counters = list(buslog.counters(buslog.named(frames, "CurrentCommand")))
    assert all((b - a) % 16 == 1 for a, b in pairwise(counters))


@pytest.mark.parametrize("fault", FAULTS)
def test_after_a_kill_and_after_a_hung_tick_the_bus_is_left_with_zero_ampere(
    life: Result, fault: str
) -> None:
    times, ends = (
        buslog.marks(life.read("marks")),
        [float(line) for line in life.read("stop_post_ends").split()],
    )
    end_s = min(end for end in ends if end > times[fault])
    assert end_s < times[f"back_{fault}"]
    commands = buslog.named(buslog.read(life.read("bus.log")), "CurrentCommand")
    left = buslog.between(commands, times[fault], end_s)
    assert left, f"no CurrentCommand between {fault} and the end of ExecStopPost"
    assert buslog.currents(left[-1]) == [0.0] * 4
    assert buslog.e2e_is_right(left[-1])


@pytest.mark.parametrize("fault", FAULTS)
def test_the_service_comes_back_and_controls_again(life: Result, fault: str) -> None:
    times = buslog.marks(life.read("marks"))
    states = buslog.named(buslog.read(life.read("bus.log")), "ControllerState")
    after = buslog.between(states, times[f"back_{fault}"], times[f"active_{fault}"])
    assert set(buslog.states(after[-1])) == {"ACTIVE"}


def test_the_independent_judge_finds_nothing_from_start_to_stop(life: Result) -> None:
    assert not violations(life)


def test_the_journal_names_what_ended_the_daemon(life: Result) -> None:
    journal = life.read("journal.log")
    assert re.search(r"Main process exited, code=killed, status=9/KILL", journal)
    assert "Watchdog timeout" in journal
    assert "Failed with result 'watchdog'" in journal
    assert f"restart counter is at {len(FAULTS)}" in journal


def test_what_the_daemon_says_is_in_fields_of_the_journal(life: Result) -> None:
    assert len(journal_lines(life, "running")) == 1 + len(FAULTS)
    for line in journal_lines(life, "realtime"):
        assert line["MRCTL_PRIORITY"] == "FIFO 40"
        assert line["MRCTL_LOCK_MEMORY"] == "all"
        assert line["MRCTL_FREEZE_GC"] == "off"
        assert "MRCTL_REFUSED" not in line
    active = [line for line in journal_lines(life, "state") if line["MRCTL_AFTER"] == "ACTIVE"]
    assert {"MRCTL_BEFORE", "MRCTL_CAUSE", "MRCTL_DAMPERS"} <= set(active[0])


def test_a_stop_ramps_to_zero_ampere_and_ends_with_status_0(life: Result) -> None:
    times = buslog.marks(life.read("marks"))
    commands = buslog.named(buslog.read(life.read("bus.log")), "CurrentCommand")
    stop = buslog.between(commands, times["stopping"], times["stopped"])
    assert buslog.currents(stop[-1]) == [0.0] * 4
    assert not buslog.between(commands, times["stopped"], float("inf"))
    journal = life.read("journal.log")
    (stopped,) = journal_lines(life, "stopped")
    assert stopped["MRCTL_AT_REST"] == "True"
    assert "mrctl.service: Deactivated successfully" in journal


@pytest.mark.parametrize("unit", [UNIT, TEMPLATE], ids=lambda path: path.name)
def test_a_unit_is_exposed_at_most_1_4(unit: Path) -> None:
    command = ["systemd-analyze", "security", "--offline=true", "--no-pager", str(unit)]
    printed = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    (exposure,) = re.findall(r"Overall exposure level for \S+: ([0-9.]+)", printed)
    assert float(exposure) <= 1.4


def test_the_template_is_the_unit_with_the_instance_as_the_configuration_name() -> None:
    def settings(path: Path) -> list[str]:
        return [line for line in path.read_text().splitlines() if line and not line.startswith("#")]

    unit = [line.replace("/etc/mrctl/vehicle.yaml", "/etc/mrctl/%i.yaml") for line in settings(UNIT)]
    description = "Description=Controller of magnetorheological dampers"
    assert [line.replace(f"{description} (%i)", description) for line in settings(TEMPLATE)] == unit
