"""A receiver: frames that are good or not, and the two ways in which it is built."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from runtime.bench import RULES, SPECS

from mrctl.can.codec import make_encoder
from mrctl.runtime.channel import Channel
from mrctl.runtime.compiled import COMPILED, receiver_kind
from mrctl.runtime.receiver import FrameReceiver

DT_S = 0.002
SPEC = SPECS["RelativeVelocity"]
ENCODE = make_encoder(SPEC)
VALUES = st.one_of(st.sampled_from([0.0, 0.1, -0.1, 1.999, -2.0, 2.04, math.nan]), st.floats(-2.1, 2.1))
# Ticks since the frame before, step of the counter, values, and a way to spoil the frame.
FRAMES = st.lists(
    st.tuples(
        st.integers(0, 40),
        st.sampled_from([1, 1, 1, 1, 0, 2, 5, 6, 15]),
        st.lists(VALUES, min_size=4, max_size=4),
        st.sampled_from(["", "", "", "", "crc", "short", "long"]),
    ),
    max_size=60,
)


def built(kind):
    rejected = Counter()
    users = [[Channel(RULES["relative_velocity"], DT_S, 2) for _ in range(n)] for n in (1, 2, 1, 0)]
    return kind(SPEC, users, rejected, DT_S), rejected


def state(receiver):
    names = ("value", "ok", "well", "last", "until", "changed", "fault")
    return [
        [*(getattr(channel, name) for name in names), channel.substitutable(0)]
        for channel in receiver.channels
    ]


@settings(max_examples=300)
@given(FRAMES, st.integers(0, 15))
def test_the_receiver_that_runs_does_what_the_plain_one_does(frames, counter):
    one, one_rejected = built(FrameReceiver)
    other, other_rejected = built(receiver_kind())
    now = 0
    for ticks, step, values, spoilt in frames:
        now, counter = now + ticks, counter + step
        data = ENCODE(values, counter)
        if spoilt == "crc":
            data = bytes([data[0] ^ 4, *data[1:]])
        elif spoilt:
            data = data[:-1] if spoilt == "short" else data + b"\0"
        assert one.take(data, now) == other.take(data, now)
        for receiver in (one, other):
            for channel in receiver.channels:
                channel.update(now)
        assert state(one) == state(other)
        assert one_rejected == other_rejected


@pytest.mark.skipif(COMPILED, reason="compiled, the plain receiver is the faster one")
def test_the_interpreter_gets_a_receiver_written_for_its_frame():
    assert receiver_kind() is not FrameReceiver


def test_a_frame_longer_than_eight_bytes_is_read_too():
    spec = replace(SPEC, length=12, background=bytes(12))
    encode = make_encoder(spec)
    for kind in (FrameReceiver, receiver_kind()):
        channels = [[Channel(RULES["relative_velocity"], DT_S, 1)] for _ in range(4)]
        receiver = kind(spec, channels, Counter(), DT_S)
        assert receiver.take(encode([0.1, 0.2, 0.3, 0.4], 1), 5)
        assert [c.value for (c,) in channels] == pytest.approx([0.1, 0.2, 0.3, 0.4], abs=1e-3)
        assert not receiver.take(bytes(8), 6)
