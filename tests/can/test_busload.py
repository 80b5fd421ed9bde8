from __future__ import annotations

import random

import pytest

from mrctl.can.busload import LIMIT, FrameRate, bus_load, classic_bits, fd_bits
from mrctl.can.database import load_database
from mrctl.share_path import share_file

FRAMES = load_database(share_file("dbc/mrctl.dbc"))


def _rates(rates_hz: dict[str, float]) -> list[FrameRate]:
    return [FrameRate(name, FRAMES[name].length, FRAMES[name].extended, hz) for name, hz in rates_hz.items()]


def _profile(fast_hz: float) -> dict[str, float]:
    fast = dict.fromkeys(("RelativeVelocity", "BodyVelocity", "CurrentCommand"), fast_hz)
    return fast | {"CaseTemperature": 10, "ControllerState": 50, "Health": 10}


@pytest.mark.parametrize(
    ("length", "extended", "bits"),
    [(8, False, 135), (8, True, 160), (1, False, 65), (0, False, 55), (0, True, 80)],
)
def test_classic_frames_take_the_published_bits(length: int, extended: bool, bits: int) -> None:  # noqa: FBT001  # a column of the table
    assert classic_bits(length, extended=extended) == (bits, 0)


def test_fd_frame_of_8_bytes_is_counted_field_by_field() -> None:
    # Nominal: 17 up to BRS, 4 stuff bits, 13 from the CRC delimiter to the end of the silence.
    # Data: ESI, 4 of DLC, 64, 17 stuff bits, 4 of stuff count, 17 of CRC, 6 fixed stuff bits.
    assert fd_bits(8, extended=False) == (17 + 4 + 13, 1 + 4 + 64 + 17 + 4 + 17 + 6)
    assert fd_bits(64, extended=True) == (36 + 8 + 13, 5 + 512 + 130 + 4 + 21 + 7)


def test_fd_payloads_are_filled_up_to_the_next_length() -> None:
    assert fd_bits(9, extended=False) == fd_bits(12, extended=False)
    assert (
        fd_bits(16, extended=False).data
        < fd_bits(17, extended=False).data
        == fd_bits(20, extended=False).data
    )


def test_lengths_that_do_not_exist_are_refused() -> None:
    with pytest.raises(ValueError, match="0 to 8 bytes"):
        classic_bits(9, extended=False)
    with pytest.raises(ValueError, match="0 to 64 bytes"):
        fd_bits(65, extended=False)


def _stuffed(bits: list[int]) -> int:
    """Length after stuffing: a complementary bit after five equal ones, itself counted for the next five."""
    count, run, last = 0, 0, None
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        count += 1
        if run == 5:
            count += 1
            last, run = 1 - bit, 1
    return count


def _crc15(bits: list[int]) -> list[int]:
    crc = 0
    for bit in bits:
        feedback = bit ^ crc >> 14 & 1
        crc = (crc << 1 & 0x7FFF) ^ (0x4599 if feedback else 0)
    return [crc >> i & 1 for i in range(14, -1, -1)]


def _numbers(rng: random.Random, length: int) -> tuple[int, int]:
    payloads = [0, (1 << 8 * length) - 1, rng.getrandbits(8 * length) if length else 0]
    payloads.append(int("0000111100001111" * length or "0", 2) & (1 << 8 * length) - 1)
    return rng.choice([0, 0x7FF, 0x78, rng.getrandbits(11)]), rng.choice(payloads)


def test_no_classic_frame_is_longer_than_the_bound() -> None:
    rng = random.Random(1)
    longest = 0
    for _ in range(3000):
        length = rng.choice([0, 1, 8])
        identifier, payload = _numbers(rng, length)
        # Start, identifier, RTR, IDE, r0, length, payload, CRC.
        text = f"0{identifier:011b}000{length:04b}" + (f"{payload:0{8 * length}b}" if length else "")
        bits = [int(bit) for bit in text]
        bits += _crc15(bits)
        sent = _stuffed(bits) + 1 + 2 + 7 + 3
        bound = classic_bits(length, extended=False).nominal
        assert sent <= bound
        if length == 8:
            longest = max(longest, sent)
    assert longest >= 125  # the bound is no fantasy: the fixed header bits alone keep it from being reached


def test_no_fd_frame_has_more_dynamic_stuff_bits_than_the_bound() -> None:
    rng = random.Random(2)
    for _ in range(3000):
        identifier, payload = _numbers(rng, 8)
        arbitration = [int(bit) for bit in f"0{identifier:011b}001" + "01"]
        whole = arbitration + [int(bit) for bit in f"0{8:04b}{payload:064b}"]
        nominal, data = fd_bits(8, extended=False)
        assert _stuffed(arbitration) <= nominal - 13
        assert _stuffed(whole) <= nominal - 13 + data - 27


def test_the_default_profile_of_500_hz_fits_a_classic_bus_of_500_kbit_s() -> None:
    load = bus_load(_rates(_profile(500)), 500_000)
    assert load.total == pytest.approx((3 * 500 + 10 + 50 + 10) * 135 / 500_000)
    assert load.total <= LIMIT
    assert [frame.name for frame in load.frames] == list(_profile(500))
    assert load.frames[0].fraction == pytest.approx(0.135)


def test_1_khz_needs_can_fd_and_fits_there() -> None:
    assert bus_load(_rates(_profile(1000)), 500_000).total > LIMIT
    load = bus_load(_rates(_profile(1000)), 500_000, 2_000_000)
    assert load.total <= LIMIT
    assert load.frames[0].duration_s == pytest.approx(34 / 500e3 + 113 / 2e6)


def test_even_all_frames_of_the_dbc_at_their_cycle_times_fit() -> None:
    rates = {name: 1 / spec.cycle_s for name, spec in FRAMES.items() if spec.cycle_s}
    assert len(rates) == len(FRAMES)
    assert bus_load(_rates(rates), 500_000).total <= LIMIT
