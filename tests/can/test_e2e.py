from __future__ import annotations

import itertools
import random

import pytest
from e2e.p02 import e2e_p02_check  # the package autosar-e2e, the oracle
from e2e_million import DifferenceError, compare
from hypothesis import given
from hypothesis import strategies as st

from mrctl.can import e2e
from mrctl.can.database import load_database
from mrctl.share_path import share_file

FRAMES = load_database(share_file("dbc/mrctl.dbc"))


def test_crc_of_the_catalogue_check_string() -> None:
    # CRC-8/AUTOSAR of "123456789" is 0xDF; the data ID is its last byte here, byte 0 is not read.
    assert e2e.crc(b"\0" + b"12345678", ord("9")) == 0xDF


def test_protect_and_check_agree_with_autosar_on_random_frames() -> None:
    agreed = compare(10_000, seed=2)
    assert agreed["whole, accepted"] == 10_000
    assert agreed["one to three bits wrong, refused"] > 9_900  # in 8 bytes all, in 64 not quite
    assert agreed["random, accepted"] > 10  # one in 256 by chance
    assert agreed["of another data ID, refused"] > 9_900


def test_a_difference_from_autosar_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(e2e, "check", lambda _data, _data_ids: True)
    with pytest.raises(DifferenceError, match="True here"):
        compare(1000, seed=2)


@given(st.binary(max_size=64), st.binary(min_size=16, max_size=16))
def test_check_takes_any_bytes_and_agrees_with_autosar(data: bytes, data_ids: bytes) -> None:
    expected = len(data) >= 2 and e2e_p02_check(data, data_ids, length=len(data))
    assert e2e.check(data, data_ids) == expected


@given(st.binary(min_size=2, max_size=64), st.binary(min_size=16, max_size=16), st.integers())
def test_protect_changes_only_crc_and_counter(data: bytes, data_ids: bytes, counter: int) -> None:
    frame = bytearray(data)
    e2e.protect(frame, data_ids, counter)
    assert frame[2:] == data[2:]
    assert frame[1] >> 4 == data[1] >> 4
    assert e2e.counter_of(bytes(frame)) == counter % 16


def _undetected_errors(frame: bytes, data_ids: bytes) -> tuple[int, int]:
    number = int.from_bytes(frame)
    tried = undetected = 0
    for weight in (1, 2, 3):
        for bits in itertools.combinations(range(64), weight):
            damaged = number ^ sum(1 << bit for bit in bits)
            tried += 1
            undetected += e2e.check(damaged.to_bytes(8), data_ids)
    return tried, undetected


@pytest.mark.parametrize("name", sorted(FRAMES))
def test_every_error_of_one_to_three_bits_is_found_in_every_frame(name: str) -> None:
    data_ids = FRAMES[name].data_ids
    rng = random.Random(name)
    frame = bytearray(rng.randbytes(8))
    e2e.protect(frame, data_ids, rng.randrange(16))
    assert _undetected_errors(bytes(frame), data_ids) == (43_744, 0)


@pytest.mark.parametrize("counter", range(16))
def test_errors_that_hit_the_counter_are_found_from_every_counter(counter: int) -> None:
    data_ids = FRAMES["RelativeVelocity"].data_ids
    frame = bytearray(8)
    e2e.protect(frame, data_ids, counter)
    number = int.from_bytes(frame)
    for bits in itertools.product(range(48, 52), range(64), range(64)):  # bits 48 to 51: the counter
        error = 0
        for bit in bits:
            error |= 1 << bit
        assert not e2e.check((number ^ error).to_bytes(8), data_ids)


def test_no_frame_passes_for_another() -> None:
    rng = random.Random(2)
    for sender, receiver in itertools.permutations(FRAMES.values(), 2):
        for counter in range(16):
            frame = bytearray(rng.randbytes(8))
            e2e.protect(frame, sender.data_ids, counter)
            assert not e2e.check(bytes(frame), receiver.data_ids)


@pytest.mark.parametrize(
    ("counter", "previous", "delta"),
    [(0, 15, 1), (5, 5, 0), (6, 5, 1), (7, 5, 2), (4, 5, 15), (0, 0, 0), (15, 0, 15), (3, 12, 7)],
)
def test_counter_delta_counts_the_steps_around_the_wrap(counter: int, previous: int, delta: int) -> None:
    assert e2e.counter_delta(counter, previous) == delta
