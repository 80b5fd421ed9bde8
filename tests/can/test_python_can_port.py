from __future__ import annotations

from collections.abc import Iterator
from uuid import uuid4

import pytest

from mrctl.can.ports import FRAMES_PER_CALL, Port, open_port
from mrctl.can.python_can_port import PythonCanPort
from mrctl.can.quiet_import import can
from mrctl.can.specs import FD_FLAG
from mrctl.errors import BusError


@pytest.fixture
def channel() -> str:
    return f"test-{uuid4()}"


@pytest.fixture
def port(channel: str) -> Iterator[Port]:
    opened = open_port("virtual", channel, 500_000, False, [0x110, 0x98FF1015])
    yield opened
    opened.close()


@pytest.fixture
def other(channel: str) -> Iterator[can.BusABC]:
    with can.Bus(interface="virtual", channel=channel) as bus:
        yield bus


def test_two_ports_talk_and_do_not_hear_themselves(port: Port, channel: str) -> None:
    peer = open_port("virtual", channel, 500_000, False, [0x100])
    assert port.send(0x100, b"12345678")
    assert peer.send(0x98FF1015, b"")
    assert peer.receive() == [(0x100, b"12345678")]
    assert port.receive() == [(0x98FF1015, b"")]
    assert port.receive() == peer.receive() == []
    assert (port.counters.sent, port.counters.received) == (1, 1)
    peer.close()


def test_what_came_before_the_start_is_discarded(port: Port, other: can.BusABC) -> None:
    for _ in range(2 * FRAMES_PER_CALL):
        other.send(can.Message(arbitration_id=0x110, is_extended_id=False, data=b"old"))
    port.discard()
    other.send(can.Message(arbitration_id=0x110, is_extended_id=False, data=b"new"))
    assert port.receive() == [(0x110, b"new")]
    assert port.counters.stale == 2 * FRAMES_PER_CALL


def test_unwanted_frames_do_not_stop_the_wanted_ones_behind_them(port: Port, other: can.BusABC) -> None:
    for can_id in (0x7, 0x110, 0x8, 0x110):
        other.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=b"x"))
    other.send(can.Message(arbitration_id=0x110, is_extended_id=True, data=b"not the standard one"[:8]))
    assert port.receive() == [(0x110, b"x"), (0x110, b"x")]


def test_remote_and_error_frames_come_through_with_their_flags(port: Port, other: can.BusABC) -> None:
    other.send(can.Message(arbitration_id=0x110, is_extended_id=False, is_remote_frame=True, dlc=8))
    other.send(can.Message(arbitration_id=0x40, is_extended_id=False, is_error_frame=True, data=bytes(8)))
    assert port.receive() == [(0x40000110, b""), (0x20000040, bytes(8))]
    assert port.counters.error_frames == 1


def test_one_call_gives_a_bounded_number_of_frames(port: Port, other: can.BusABC) -> None:
    for _ in range(FRAMES_PER_CALL + 10):
        other.send(can.Message(arbitration_id=0x110, is_extended_id=False))
    assert len(port.receive()) == FRAMES_PER_CALL
    assert len(port.receive()) == 10


def test_fd_frames_are_sent_with_a_bit_rate_switch(channel: str, other: can.BusABC) -> None:
    port = open_port("virtual", channel, 500_000, True, [], data_bitrate=2_000_000)
    assert port.send(0x80000005, bytes(12))
    message = other.recv(timeout=1)
    assert message is not None
    assert (message.is_fd, message.bitrate_switch, message.is_extended_id, message.dlc) == (
        True,
        True,
        True,
        12,
    )
    port.close()


class BrokenBus(can.BusABC):
    """A driver that fails when it is told to."""

    channel_info = "broken"

    def __init__(self) -> None:
        super().__init__(channel="broken")
        self.fails = True

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        del msg, timeout
        if self.fails:
            raise can.CanOperationError("no acknowledge")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        del timeout
        if self.fails:
            raise can.CanOperationError("unplugged")
        return None, False


def test_a_failing_driver_is_told_once_a_row_and_never_raises() -> None:
    bus = BrokenBus()
    port = PythonCanPort(bus, [1])
    assert [port.send(1, b"") for _ in range(3)] == [False] * 3
    assert [port.receive() for _ in range(3)] == [[]] * 3
    assert [event.kind for event in port.take_events()] == ["send_refused", "receive_failed"]
    bus.fails = False
    assert port.send(1, b"")
    assert port.receive() == []
    assert [event.kind for event in port.take_events()] == ["send_resumed"]
    assert port.counters.send_failed == 3
    port.close()


def test_events_that_nobody_takes_do_not_pile_up() -> None:
    bus = BrokenBus()
    port = PythonCanPort(bus, [1])
    for fails in (True, False) * 500:
        bus.fails = fails
        port.send(1, b"")
    assert len(port.take_events()) <= 64
    port.close()


@pytest.mark.parametrize(
    ("interface", "said"),
    [
        ("telepathy", "python-can knows no interface telepathy; use one of: .*virtual"),
        ("serial", "CAN bus serial nowhere cannot be opened: .*; check channel and driver"),
        ("pcan", "CAN bus pcan nowhere cannot be opened: .*; check channel and driver"),
    ],
)
def test_a_bus_that_cannot_be_opened_is_said_in_one_line(interface: str, said: str) -> None:
    with pytest.raises(BusError, match=said) as caught:
        open_port(interface, "nowhere", 500_000, False, [1])
    assert "\n" not in str(caught.value)


def test_an_fd_frame_is_marked_where_classic_ones_are_expected() -> None:
    port = open_port("virtual", "test-fd-mark", 500_000, False, [0x110])
    with can.Bus(interface="virtual", channel="test-fd-mark") as sender:
        sender.send(can.Message(arbitration_id=0x110, data=b"12345678", is_fd=True, is_extended_id=False))
        sender.send(can.Message(arbitration_id=0x110, data=b"classic!", is_extended_id=False))
        assert port.receive() == [(FD_FLAG | 0x110, b"12345678"), (0x110, b"classic!")]
    port.close()
