"""SocketCanPort on a real interface: everything that happens to one, in the order of a bad day."""

from __future__ import annotations

import json
from typing import Any

import pytest
from bed import Bed

pytestmark = pytest.mark.testbed

# Two ports in one process; each `say` prints a line of JSON with the link events of both since the last one.
TOUR = """
import json
import subprocess
import time

from mrctl.can.ports import open_port
from mrctl.errors import BusError


def ip(*words):
    subprocess.run(["ip", "link", *words], check=True)


def until(port, condition):
    frames, end = [], time.monotonic() + 10
    while not condition(frames):
        if time.monotonic() > end:
            raise SystemExit(f"timed out with {frames}, {port.counters}")
        frames += port.receive()
        time.sleep(0.005)
    return [[hex(can_id), data.decode()] for can_id, data in frames]


def say(step, **more):
    events = [[event.kind for event in port.take_events()] for port in (a, b)]
    print(json.dumps({"step": step, "events": events, **more}), flush=True)


def refusal(channel, fd):
    try:
        open_port("socketcan", channel, 500_000, fd, [1])
    except BusError as error:
        return str(error)


ip("set", "vcan0", "down")
ip("set", "vcan0", "mtu", "16")
refused = [refusal("vcan9", False), refusal("lo", False), refusal("vcan0", True)]
a = open_port("socketcan", "vcan0", 500_000, False, [0x110, 0x80000110])
b = open_port("socketcan", "vcan0", 500_000, False, [0x100])
say("opened", refused=refused)
ip("set", "vcan0", "up")
for port in (a, b):
    until(port, lambda _: port.counters.reopened == 1)
say("up")
for can_id in (0x111, 0x110, 0x40000110, 0x80000110, 0x112):
    b.send(can_id, b"abc")
a.send(0x100, b"own")
b.receive()  # else it is stale by the next time
say("filtered", frames=until(a, lambda frames: len(frames) == 3), more=len(a.receive()))

ip("set", "vcan0", "down")
a.receive()
say("down", sent=[a.send(0x100, b"") for _ in range(3)] + [b.send(0x110, b"")])
ip("set", "vcan0", "up")
for port in (a, b):
    until(port, lambda _: port.counters.reopened == 2)
b.send(0x110, b"up")
say("up again", frames=until(a, len))

ip("del", "vcan0")
a.receive()
say("deleted", sent=[a.send(0x100, b""), b.send(0x110, b"")])
ip("add", "vcan0", "type", "vcan")
ip("set", "vcan0", "up")
for port in (a, b):
    until(port, lambda _: port.counters.reopened == 3)
for can_id in (0x111, 0x110, 0x112):
    b.send(can_id, b"new")
time.sleep(0.05)  # less than makes a frame stale
say("added", frames=until(a, len), more=len(a.receive()))

sent = sum(b.send(0x110, b"12345678") for _ in range(20_000))
before, frames = a.counters.received, a.receive()
while frames:
    frames = a.receive()
b.send(0x110, b"last")
until(a, len)
counts = a.counters
say("overflow", sent=sent + 1, received=counts.received - before, dropped=counts.dropped, stale=counts.stale)
a.close()
b.close()
"""


@pytest.fixture(scope="module")
def tour(bus: Bed) -> dict[str, dict[str, Any]]:
    result = bus.run('"$PYTHON" tour.py', files={"tour.py": TOUR}, timeout_s=120).checked()
    return {line["step"]: line for line in map(json.loads, result.stdout.splitlines())}


def test_what_cannot_be_opened_is_refused_with_the_mend(tour: dict[str, dict[str, Any]]) -> None:
    missing, no_can, no_fd = tour["opened"]["refused"]
    assert missing == "there is no CAN interface vcan9; sudo ip link add vcan9 type vcan"
    assert no_can == "there is no CAN interface lo; see ip link show type can"
    assert no_fd.startswith("CAN interface vcan0 is not set up for CAN FD; ")


def test_an_interface_that_is_down_at_the_start_is_waited_for(tour: dict[str, dict[str, Any]]) -> None:
    assert tour["opened"]["events"] == [["link_down"], ["link_down"]]
    assert tour["up"]["events"] == [["link_up"], ["link_up"]]


def test_the_kernel_filters_what_nobody_wants_and_own_frames(tour: dict[str, dict[str, Any]]) -> None:
    assert tour["filtered"]["frames"] == [["0x110", "abc"], ["0x40000110", "abc"], ["0x80000110", "abc"]]
    assert tour["filtered"]["more"] == 0


def test_down_and_up_is_survived(tour: dict[str, dict[str, Any]]) -> None:
    assert tour["down"]["events"] == [["link_down"], ["link_down"]]
    assert not any(tour["down"]["sent"])
    assert tour["up again"]["events"] == [["link_up"], ["link_up"]]
    assert tour["up again"]["frames"] == [["0x110", "up"]]


def test_removed_and_added_again_is_survived_with_the_filters(tour: dict[str, dict[str, Any]]) -> None:
    assert [events[-1] for events in tour["deleted"]["events"]] == ["link_gone", "link_gone"]
    assert not any(tour["deleted"]["sent"])
    assert tour["added"]["events"] == [["link_back", "link_up"], ["link_back", "link_up"]]
    assert tour["added"]["frames"] == [["0x110", "new"]]
    assert tour["added"]["more"] == 0


def test_every_frame_that_the_buffer_lost_is_counted(tour: dict[str, dict[str, Any]]) -> None:
    overflow = tour["overflow"]
    assert overflow["dropped"] > 0
    assert overflow["received"] + overflow["stale"] + overflow["dropped"] == overflow["sent"]
    assert set(overflow["events"][0]) <= {"frames_dropped", "frames_stale"}
    assert "frames_dropped" in overflow["events"][0]
