"""SocketCanPort on a socket pair that carries the kernel's frames; the test bed has the real kernel."""

from __future__ import annotations

import errno
import os
import socket
import struct
from types import SimpleNamespace

import pytest

from mrctl.can import linux
from mrctl.can.ports import FRAMES_PER_CALL, LINK_EVENTS, open_port
from mrctl.can.socketcan_port import RECEIVE_BUFFER_BYTES, RETRY_S, STALE_CALLS_MAX, SocketCanPort
from mrctl.can.specs import FD_FLAG
from mrctl.errors import BusError

WANTED = (0x110, 0x98FF1015)


class FakeKernel:
    """The socket that python-can would have opened, and the knobs that a kernel turns."""

    def __init__(self) -> None:
        self.ours, self.bus = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.bus.setblocking(False)
        self.is_up, self.exists = True, True
        self.receive_errors: list[int] = []
        self.send_errors: list[int] = []
        self.dropped: int | None = None
        self.endless = False
        self.waited_s: list[float] = []  # of the last frame of a full call, from one question to the next
        self.held_up_s: list[float] = []  # before a frame is read
        self.options: list[tuple[int, int, object]] = []
        self.binds: list[object] = []
        self.now_s = 100.0
        self.closed = False

    # What the port calls.
    def setblocking(self, blocking: bool) -> None:  # noqa: FBT001  # the signature of socket
        self.ours.setblocking(blocking)

    def setsockopt(self, level: int, option: int, value: object) -> None:
        if option == linux.SO_RCVBUFFORCE:
            raise PermissionError(errno.EPERM, "Operation not permitted")
        self.options.append((level, option, value))

    def bind(self, address: object) -> None:
        self.binds.append(address)
        if not self.exists:
            raise OSError(errno.ENODEV, "No such device")

    def getsockopt(self, level: int, option: int) -> int:
        assert (level, option) == (socket.SOL_SOCKET, socket.SO_ERROR)
        return self.receive_errors.pop(0) if self.receive_errors else 0

    def recvmsg(
        self, size: int, ancillary_size: int
    ) -> tuple[bytes, list[tuple[int, int, bytes]], int, object]:
        if self.receive_errors:
            number = self.receive_errors.pop(0)
            raise OSError(number, os.strerror(number))
        self.now_s += self.held_up_s.pop(0) if self.held_up_s else 0.0
        data, _, flags, address = self.ours.recvmsg(size, ancillary_size)
        if self.endless:
            self.bus.send(data)
        ancillary = []
        if self.dropped is not None:
            ancillary = [(socket.SOL_SOCKET, linux.SO_RXQ_OVFL, struct.pack("=I", self.dropped))]
        return data, ancillary, flags, address

    def send(self, frame: bytes) -> int:
        if self.send_errors:
            number = self.send_errors.pop(0)
            raise OSError(number, os.strerror(number))
        return self.ours.send(frame)

    # What the test does.
    def frame(self, can_id: int, data: bytes) -> None:
        self.bus.send(linux.CLASSIC_FRAME.pack(can_id, len(data), data))

    def interface_is_up(self, _socket: object, _channel: str) -> bool:
        if not self.exists:
            raise OSError(errno.ENODEV, "No such device")
        return self.is_up

    def last_stamp_s(self, _socket: object) -> float:
        if not self.waited_s:
            raise OSError(errno.ENOENT, "No such file or directory")
        return 5000.0 - self.waited_s.pop(0)

    def shutdown(self) -> None:
        self.closed = True
        self.ours.close()


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> FakeKernel:
    fake = FakeKernel()
    monkeypatch.setattr(linux, "interface_is_up", fake.interface_is_up)
    monkeypatch.setattr(linux, "last_stamp_s", fake.last_stamp_s)
    return fake


def _port(kernel: FakeKernel, *, fd: bool = False) -> SocketCanPort:
    bus = SimpleNamespace(socket=kernel, shutdown=kernel.shutdown)
    return SocketCanPort(
        bus, "can7", WANTED, fd=fd, clock_s=lambda: kernel.now_s, wall_clock_s=lambda: 5000.0
    )


def _kinds(port: SocketCanPort) -> list[str]:
    events = port.take_events()
    assert all(event.kind in LINK_EVENTS and event.detail for event in events)
    return [event.kind for event in events]


def test_receive_gives_all_that_waits_with_the_flags_of_linux_and_never_blocks(kernel: FakeKernel) -> None:
    port = _port(kernel)
    assert port.receive() == []
    frames = [(0x110, b"12345678"), (0x98FF1015, b""), (0x40000110, b""), (0x110, b"abc")]
    for frame in frames:
        kernel.frame(*frame)
    assert port.receive() == frames
    assert port.receive() == []
    assert port.counters.received == 4


def test_one_call_gives_a_bounded_number_of_frames(kernel: FakeKernel) -> None:
    port = _port(kernel)
    frame = linux.CLASSIC_FRAME.pack(0x110, 1, b"x")
    sent = 0
    got = 0
    while sent < 2 * FRAMES_PER_CALL:
        try:
            while sent < 2 * FRAMES_PER_CALL:
                kernel.bus.send(frame)
                sent += 1
        except BlockingIOError:
            pass
        frames = port.receive()
        assert len(frames) <= FRAMES_PER_CALL
        got += len(frames)
    got += len(port.receive()) + len(port.receive())
    assert got == sent == port.counters.received

    kernel.endless = True
    kernel.frame(0x110, b"x")
    assert len(port.receive()) == FRAMES_PER_CALL


def test_send_writes_the_frames_of_the_kernel(kernel: FakeKernel) -> None:
    port = _port(kernel)
    assert port.send(0x100, b"12345678")
    assert port.send(0x98FF1015, b"abc")
    assert kernel.bus.recv(100) == struct.pack("=IB3x8s", 0x100, 8, b"12345678")
    assert kernel.bus.recv(100) == struct.pack("=IB3x8s", 0x98FF1015, 3, b"abc")
    assert port.counters.sent == 2


def test_fd_frames_are_sent_with_a_bit_rate_switch_and_received_beside_classic_ones(
    kernel: FakeKernel,
) -> None:
    port = _port(kernel, fd=True)
    assert port.send(0x100, b"12345678")
    frame = kernel.bus.recv(100)
    assert len(frame) == 72
    assert frame[4:8] == b"\x08\x01\0\0"
    kernel.bus.send(struct.pack("=IBB2x64s", 0x110, 12, 1, b"123456789abc"))
    kernel.frame(0x110, b"classic!")
    assert port.receive() == [(0x110, b"123456789abc"), (0x110, b"classic!")]


def test_fd_frames_are_marked_where_classic_ones_are_expected(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.bus.send(struct.pack("=IBB2x64s", 0x110, 8, 1, b"12345678"))
    kernel.frame(0x110, b"classic!")
    assert port.receive() == [(FD_FLAG | 0x110, b"12345678"), (0x110, b"classic!")]


def test_frames_that_waited_for_too_long_behind_others_are_thrown_away_and_counted(
    kernel: FakeKernel,
) -> None:
    port = _port(kernel)
    kernel.endless = True
    kernel.frame(0x110, b"x")
    kernel.waited_s = [3.0, 2.0, 0.05]
    assert len(port.receive()) == FRAMES_PER_CALL
    assert port.counters.stale == FRAMES_PER_CALL + 1
    assert port.counters.received == FRAMES_PER_CALL
    assert _kinds(port) == ["frames_stale"]


def test_the_few_behind_a_full_call_of_stale_frames_are_asked_one_by_one(kernel: FakeKernel) -> None:
    port = _port(kernel)
    for data in (b"old",) * (FRAMES_PER_CALL + 2) + (b"new",):
        kernel.frame(0x110, data)
    kernel.waited_s = [2.0, 1.9, 1.8, 0.01]
    assert port.receive() == [(0x110, b"new")]
    assert port.counters.stale == FRAMES_PER_CALL + 2


def test_what_was_read_while_the_call_itself_was_held_up_is_not_fresh(kernel: FakeKernel) -> None:
    """A controller that is stopped in the middle of the call finds what came meanwhile, and reads on."""
    port = _port(kernel)
    kernel.held_up_s = [2.0]
    for data in (b"0", b"1", b"2"):
        kernel.frame(0x110, data)
    assert port.receive() == []
    assert (port.counters.stale, port.counters.received) == (3, 0)
    assert _kinds(port) == ["frames_stale"]
    kernel.frame(0x110, b"new")
    assert port.receive() == [(0x110, b"new")]


def test_a_full_call_of_fresh_frames_loses_none(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.endless = True
    kernel.frame(0x110, b"x")
    kernel.waited_s = [0.02, -3600.0, 0.02]  # a clock that was set back an hour makes nothing stale
    for _ in range(3):
        assert len(port.receive()) == FRAMES_PER_CALL
    assert port.counters.stale == 0
    assert _kinds(port) == []


def test_what_came_before_the_start_is_discarded(kernel: FakeKernel) -> None:
    port = _port(kernel)
    for k in range(5):
        kernel.frame(0x110, bytes([k]))
    port.discard()
    kernel.frame(0x110, b"new")
    assert port.receive() == [(0x110, b"new")]
    assert (port.counters.stale, port.counters.received) == (5, 1)
    assert _kinds(port) == []  # nothing that anybody must know


def test_a_bus_that_never_pauses_does_not_hold_up_the_start(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.endless = True
    kernel.frame(0x110, b"x")
    port.discard()
    assert port.counters.stale == STALE_CALLS_MAX * FRAMES_PER_CALL


def test_few_frames_on_a_bus_that_died_while_nobody_asked_are_not_fresh(kernel: FakeKernel) -> None:
    port = _port(kernel)
    for _ in range(3):
        kernel.frame(0x110, b"old")
    kernel.now_s += 5.0
    kernel.waited_s = [4.0, 3.9, 3.8]
    assert port.receive() == []
    assert (port.counters.stale, port.counters.received) == (3, 0)
    assert _kinds(port) == ["frames_stale"]
    kernel.frame(0x110, b"new")
    assert port.receive() == [(0x110, b"new")]


def test_fresh_frames_after_a_sleep_are_kept_in_their_order(kernel: FakeKernel) -> None:
    port = _port(kernel)
    for data in (b"0", b"1", b"2", b"3"):
        kernel.frame(0x110, data)
    kernel.now_s += 1.0
    kernel.receive_errors = [errno.ENETDOWN]  # said once, between the frames
    kernel.waited_s = [0.3, 0.101, 0.09, 0.0]
    assert port.receive() == [(0x110, b"2"), (0x110, b"3")]
    assert port.counters.stale == 2


def test_without_time_stamps_nothing_is_thrown_away_after_a_sleep(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.frame(0x110, b"x")
    kernel.now_s += 1.0
    assert port.receive() == [(0x110, b"x")]
    assert port.counters.stale == 0


def test_the_socket_is_set_up_to_filter_and_to_count_what_it_drops(kernel: FakeKernel) -> None:
    _port(kernel)
    assert (socket.SOL_SOCKET, linux.SO_RXQ_OVFL, 1) in kernel.options
    assert (socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES) in kernel.options
    options = {(level, option): value for level, option, value in kernel.options}
    filters = options[linux.SOL_CAN_RAW, linux.CAN_RAW_FILTER]
    assert isinstance(filters, bytes)
    pairs = sorted(struct.iter_unpack("=II", filters))
    assert pairs == [(0x110, 0x800007FF), (0x98FF1015, 0x9FFFFFFF)]


def test_frames_that_the_kernel_dropped_are_counted_once(kernel: FakeKernel) -> None:
    port = _port(kernel)
    for total, counted in (
        (None, 0),
        (5, 5),
        (5, 5),
        (4722, 4722),
        (0xFFFFFFFF, 0xFFFFFFFF),
        (9, 0x100000009),
    ):
        kernel.dropped = total
        kernel.frame(0x110, b"")
        port.receive()
        assert port.counters.dropped == counted
    assert _kinds(port) == ["frames_dropped"] * 4


def test_an_interface_that_goes_down_and_up_is_survived_and_told(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.frame(0x110, b"queued")
    kernel.receive_errors = [errno.ENETDOWN]
    kernel.is_up = False
    assert port.receive() == [(0x110, b"queued")]
    assert _kinds(port) == ["link_down"]
    kernel.send_errors = [errno.ENETDOWN] * 3
    assert [port.send(0x100, b"") for _ in range(3)] == [False] * 3
    kernel.now_s += RETRY_S
    assert port.receive() == []
    assert _kinds(port) == []
    kernel.is_up = True
    kernel.now_s += RETRY_S
    kernel.frame(0x110, b"again")
    assert port.receive() == [(0x110, b"again")]
    assert _kinds(port) == ["link_up"]
    assert port.send(0x100, b"")
    assert _kinds(port) == []
    assert kernel.binds == []
    assert (port.counters.down, port.counters.reopened, port.counters.send_failed) == (1, 1, 3)


def test_a_removed_interface_is_bound_again_with_its_filters_at_most_every_100_ms(kernel: FakeKernel) -> None:
    port = _port(kernel)
    before = len(kernel.options)
    kernel.exists = False
    kernel.receive_errors = [errno.ENODEV]
    port.receive()
    assert _kinds(port) == ["link_gone"]
    for _ in range(50):  # 0.25 s of ticks
        kernel.now_s += 0.005
        kernel.send_errors = [errno.ENXIO]
        port.receive()
        assert not port.send(0x100, b"")
    assert len(kernel.binds) == 2
    assert _kinds(port) == []
    kernel.exists, kernel.is_up = True, False
    kernel.now_s += RETRY_S
    port.receive()
    assert kernel.binds[-1] == ("can7",)
    assert _kinds(port) == ["link_back"]
    kernel.receive_errors = [errno.ENETDOWN]  # the kernel says so once more after the bind
    port.receive()
    assert _kinds(port) == []
    assert [option for _, option, _ in kernel.options[before:]][-1] == linux.CAN_RAW_FILTER
    kernel.is_up = True
    kernel.now_s += RETRY_S
    port.receive()
    assert _kinds(port) == ["link_up"]
    assert len(kernel.binds) == 3
    assert (port.counters.down, port.counters.reopened) == (1, 1)


@pytest.mark.parametrize("number", [errno.ENETDOWN, errno.ENODEV])
def test_an_old_error_is_no_news_after_the_mend(kernel: FakeKernel, number: int) -> None:
    port = _port(kernel)
    kernel.send_errors = [errno.ENXIO]
    port.send(0x100, b"")
    kernel.receive_errors = [number]  # what the kernel also said, and nobody has read
    kernel.now_s += RETRY_S
    port.receive()
    assert _kinds(port) == ["link_gone", "link_back", "link_up"]


def test_an_interface_replaced_between_two_looks_is_bound_again(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.receive_errors = [errno.ENETDOWN]
    port.receive()
    kernel.receive_errors = [errno.ENODEV]  # removed and added again: the name is up, the socket is not bound
    kernel.now_s += RETRY_S
    port.receive()
    assert _kinds(port) == ["link_down", "link_gone", "link_back", "link_up"]
    assert kernel.binds == [("can7",)]


def test_down_then_removed_is_one_outage(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.is_up = kernel.exists = False
    kernel.receive_errors = [errno.ENETDOWN, errno.ENODEV]
    port.receive()
    assert _kinds(port) == ["link_down", "link_gone"]
    assert port.counters.down == 1


def test_a_removal_that_only_the_send_notices_is_noticed(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.send_errors = [errno.ENXIO]
    assert not port.send(0x100, b"")
    assert _kinds(port) == ["link_gone"]


def test_an_interface_that_is_down_at_the_start_is_waited_for(kernel: FakeKernel) -> None:
    kernel.is_up = False
    port = _port(kernel)
    assert _kinds(port) == ["link_down"]
    kernel.is_up = True
    kernel.now_s += RETRY_S
    port.receive()
    assert _kinds(port) == ["link_up"]


@pytest.mark.parametrize("number", [errno.ENOBUFS, errno.EAGAIN, errno.EINVAL, errno.EPERM])
def test_a_full_queue_is_told_once_and_never_raises(kernel: FakeKernel, number: int) -> None:
    port = _port(kernel)
    kernel.send_errors = [number] * 3
    assert [port.send(0x100, b"") for _ in range(4)] == [False, False, False, True]
    assert _kinds(port) == ["send_refused", "send_resumed"]
    assert (port.counters.sent, port.counters.send_failed, port.counters.down) == (1, 3, 0)


def test_an_unknown_receive_error_is_told_once_a_row_and_never_raises(kernel: FakeKernel) -> None:
    port = _port(kernel)
    for _ in range(3):
        kernel.receive_errors = [errno.EIO]
        assert port.receive() == []
    assert _kinds(port) == ["receive_failed"]
    kernel.frame(0x110, b"")
    assert len(port.receive()) == 1


def test_the_same_link_error_for_ever_does_not_hold_up_the_call(kernel: FakeKernel) -> None:
    port = _port(kernel)
    kernel.receive_errors = [errno.ENETDOWN] * 1000
    port.receive()
    assert len(kernel.receive_errors) >= 997


@pytest.mark.parametrize(
    ("can_id", "data", "kind"),
    [
        (0x20000040, bytes(8), "bus_off"),
        (0x20000100, bytes(8), None),  # it was on the bus all the time
        (0x20000004, b"\0\x20" + bytes(6), "bus_errors"),
        (0x20000004, b"\0\x08" + bytes(6), None),
    ],
)
def test_error_frames_become_events_and_come_through_with_their_flag(
    kernel: FakeKernel, can_id: int, data: bytes, kind: str | None
) -> None:
    port = _port(kernel)
    for _ in range(3):
        kernel.frame(can_id, data)
    assert port.receive() == [(can_id, data)] * 3
    assert port.counters.error_frames == 3
    assert _kinds(port) == ([kind] if kind else [])


def test_bus_off_and_back_again_are_both_told(kernel: FakeKernel) -> None:
    port = _port(kernel)
    for can_id in (0x20000040, 0x20000100, 0x20000040):
        kernel.frame(can_id, bytes(8))
    port.receive()
    assert _kinds(port) == ["bus_off", "bus_restarted", "bus_off"]


def test_close_shuts_the_bus(kernel: FakeKernel) -> None:
    _port(kernel).close()
    assert kernel.closed


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.ENODEV, "there is no CAN interface vcan9; sudo ip link add vcan9 type vcan"),
        (errno.EAFNOSUPPORT, "CAN interface vcan9: this kernel has no SocketCAN; sudo modprobe can-raw"),
        (errno.EPERM, "CAN interface vcan9 cannot be opened: "),
    ],
)
def test_an_interface_that_cannot_be_opened_is_said_with_the_mend(
    monkeypatch: pytest.MonkeyPatch, number: int, said: str
) -> None:
    def refuse(**_options: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("mrctl.can.socketcan_port.can.Bus", refuse)
    with pytest.raises(BusError, match=said):
        open_port("socketcan", "vcan9", 500_000, False, [1])


def test_a_classic_interface_is_refused_for_fd_and_closed(
    kernel: FakeKernel, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = SimpleNamespace(socket=kernel, shutdown=kernel.shutdown)
    monkeypatch.setattr("mrctl.can.socketcan_port.can.Bus", lambda **_options: bus)
    monkeypatch.setattr(linux, "can_carry_fd", lambda _socket, _channel: False)
    with pytest.raises(BusError, match=r"can0 is not set up for CAN FD; .*sudo ip link set can0 type can"):
        open_port("socketcan", "can0", 500_000, True, [1])
    assert kernel.closed


def test_interface_state_comes_from_the_kernel() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        assert linux.interface_is_up(sock, "lo")
        assert linux.can_carry_fd(sock, "lo")  # its mtu is 65536
        with pytest.raises(OSError, match="No such device"):
            linux.interface_is_up(sock, "nowhere7")
