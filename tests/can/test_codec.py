from __future__ import annotations

import itertools
import math
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.can import e2e
from mrctl.can.codec import crosscheck, make_decoder, make_encoder, make_raw_encoder
from mrctl.can.database import load_database
from mrctl.can.dbc_file import DbcFile
from mrctl.can.specs import FrameSpec
from mrctl.errors import MrctlError
from mrctl.share_path import share_file

DBC = share_file("dbc/mrctl.dbc")
FRAMES = load_database(DBC)
MESSAGES = DbcFile.read(DBC).messages()


def _signals_of_13_bits() -> list[str]:
    return [name for name, spec in FRAMES.items() if {signal.bits for signal in spec.signals} == {13}]


@pytest.mark.parametrize("name", _signals_of_13_bits())
def test_every_raw_value_of_every_signal_decodes_as_cantools_does(name: str) -> None:
    spec, message, decode = FRAMES[name], MESSAGES[name], make_decoder(FRAMES[name])
    for raw in range(8192):
        # Each signal sees its whole range, the four never the same value.
        raws = [(raw + 1999 * i) % 8192 for i in range(4)]
        payload = sum(value << signal.start_bit for value, signal in zip(raws, spec.signals, strict=True))
        data = payload.to_bytes(8, "little")
        theirs = message.decode(data, decode_choices=False)
        for mine, signal, value in zip(decode(data), spec.signals, raws, strict=True):
            if value == (signal.sna_raw or 0) & 0x1FFF:
                assert math.isnan(mine)
            else:
                assert mine == theirs[signal.name]
                assert isinstance(mine, float)


@pytest.mark.parametrize("name", sorted(FRAMES))
def test_every_value_comes_back_exactly_and_the_frame_is_protected(name: str) -> None:
    spec = FRAMES[name]
    encode, decode = make_encoder(spec), make_decoder(spec)
    longest = max(signal.raw_maximum - signal.raw_minimum for signal in spec.signals) + 1
    for step in range(longest):
        values = []
        for i, signal in enumerate(spec.signals):
            raw = signal.raw_minimum + (step + 7 * i) % (signal.raw_maximum - signal.raw_minimum + 1)
            values.append(raw * signal.factor + signal.offset)
        frame = encode(values, step)
        assert decode(frame) == tuple(values)
        assert len(frame) == 8
        assert e2e.counter_of(frame) == step % 16
        assert e2e.check(frame, spec.data_ids)


@given(st.sampled_from(sorted(FRAMES)), st.data(), st.integers(0, 99))
def test_raw_values_encode_as_the_values_they_stand_for(name: str, data: st.DataObject, counter: int) -> None:
    spec = FRAMES[name]
    raws = [data.draw(st.integers(signal.raw_minimum, signal.raw_maximum)) for signal in spec.signals]
    values = [raw * s.factor + s.offset for raw, s in zip(raws, spec.signals, strict=True)]
    assert make_raw_encoder(spec)(raws, counter) == make_encoder(spec)(values, counter)


@pytest.mark.parametrize("name", sorted(FRAMES))
def test_cantools_reads_what_the_encoder_sends(name: str) -> None:
    spec, message, encode = FRAMES[name], MESSAGES[name], make_encoder(FRAMES[name])
    rng = random.Random(name)
    for counter in range(200):
        values = [rng.uniform(signal.minimum, signal.maximum) for signal in spec.signals]
        theirs = message.decode(encode(values, counter), decode_choices=False)
        for value, signal in zip(values, spec.signals, strict=True):
            assert theirs[signal.name] == pytest.approx(value, abs=0.5001 * signal.factor)


any_float = st.floats(allow_nan=True, allow_infinity=True)


@given(st.sampled_from(sorted(FRAMES)), st.data(), st.integers(0, 15))
def test_any_floats_encode_into_range_or_not_available(name: str, data: st.DataObject, counter: int) -> None:
    spec = FRAMES[name]
    values = data.draw(st.lists(any_float, min_size=len(spec.signals), max_size=len(spec.signals)))
    frame = make_encoder(spec)(values, counter)
    assert e2e.check(frame, spec.data_ids)
    for value, back, signal in zip(values, make_decoder(spec)(frame), spec.signals, strict=True):
        if math.isnan(value):
            # What has no "not available" sends the value closest to 0.
            assert math.isnan(back) if signal.sna_raw is not None else back == 0
        else:
            nearest = min(max(value, signal.minimum), signal.maximum)
            assert back == pytest.approx(nearest, abs=0.5001 * signal.factor)


@pytest.mark.parametrize("endless", [math.inf, -math.inf, 1e300, -1e300])
def test_what_is_beyond_the_range_saturates_and_is_never_taken_for_not_available(endless: float) -> None:
    for spec in FRAMES.values():
        for i, signal in enumerate(spec.signals):
            values = [math.nan] * len(spec.signals)
            values[i] = endless
            back = make_decoder(spec)(make_encoder(spec)(values, 0))[i]
            assert back == pytest.approx(signal.maximum if endless > 0 else signal.minimum)


def test_a_frame_for_one_damper_says_not_available_for_the_others() -> None:
    spec = load_database(DBC, {"CurrentCommand": ["Cur_RL"]})["CurrentCommand"]
    frame = make_encoder(spec)([1.234], 7)
    assert make_decoder(spec)(frame) == (1.234,)
    every = make_decoder(FRAMES["CurrentCommand"])(frame)
    assert every[2] == 1.234
    assert [math.isnan(value) for value in every] == [True, True, False, True]


def test_signals_come_in_the_order_that_was_asked_for() -> None:
    names = ["RelVel_RR", "RelVel_FL"]
    spec = load_database(DBC, {"RelativeVelocity": names})["RelativeVelocity"]
    assert [signal.name for signal in spec.signals] == names
    assert make_decoder(spec)(make_encoder(spec)([-0.5, 0.25], 0)) == (-0.5, 0.25)


HEAD = 'VERSION ""\nNS_ :\nBS_:\nBU_: A B\n'
TAIL = 'BA_DEF_ BO_ "E2EDataIDs" STRING ;\nBA_DEF_DEF_ "E2EDataIDs" "5A";\n'


def _load(folder: Path, body: str, name: str = "F") -> tuple[FrameSpec, object]:
    path = folder / "other.dbc"
    path.write_text(HEAD + body + TAIL, encoding="cp1252")
    return load_database(path)[name], DbcFile.read(path).messages()[name]


def test_big_endian_extended_negative_and_offset_signals_work_too(tmp_path: Path) -> None:
    spec, message = _load(
        tmp_path,
        f"BO_ {0x98FF1015} F: 12 A\n"  # bit 31: extended
        ' SG_ CRC : 7|8@0+ (1,0) [0|255] "" B\n'
        ' SG_ Counter : 11|4@0+ (1,0) [0|15] "" B\n'
        ' SG_ Up : 23|13@0- (0.5,-100) [0|0] "N" B\n'
        ' SG_ Down : 26|11@0+ (-0.25,40) [0|0] "degC" B\n'
        ' SG_ Little : 44|20@1- (0.001,3) [-400|400] "m" B\n'
        ' SG_ Whole : 64|32@1- (1,0) [0|0] "" B\n',
    )
    assert (spec.can_id, spec.extended, spec.linux_id, spec.length) == (0x18FF1015, True, 0x98FF1015, 12)
    assert spec.data_ids == b"\x5a" * 16
    crosscheck(spec, message, samples=5000)
    frame = make_encoder(spec)([-123.5, 12.25, -1.234, 123456.0], 9)
    assert make_decoder(spec)(frame) == pytest.approx((-123.5, 12.25, -1.234, 123456.0), abs=1e-9)
    assert e2e.check(frame, spec.data_ids)
    assert make_decoder(spec)(make_encoder(spec)([math.nan] * 4, 0)) == pytest.approx((0, 0, 0, 0), abs=1e-9)
    assert make_decoder(spec)(make_encoder(spec)([math.inf] * 4, 0))[1] == 40


@st.composite
def layouts(draw: st.DrawFn) -> str:
    """A frame with little-endian signals up to a byte boundary, big-endian ones behind it."""
    split = draw(st.integers(2, 8))
    lines, bit = [], 12
    while bit < 8 * split:
        bits = draw(st.integers(1, 8 * split - bit))
        lines.append((bit, bits, 1))
        bit += bits
    bit = 8 * split
    while bit < 64:
        bits = draw(st.integers(1, min(52, 64 - bit)))
        lines.append((bit // 8 * 8 + 7 - bit % 8, bits, 0))
        bit += bits
    body = 'BO_ 5 F: 8 A\n SG_ C : 0|8@1+ (1,0) [0|0] "" B\n SG_ N : 8|4@1+ (1,0) [0|0] "" B\n'
    for i, (start, bits, order) in enumerate(lines):
        sign = draw(st.sampled_from("+-"))
        factor = draw(st.sampled_from(["1", "0.001", "2", "-0.5", "5e-05"]))
        offset = draw(st.sampled_from(["0", "0", "-40", "0.25"]))
        body += f' SG_ S{i} : {start}|{bits}@{order}{sign} ({factor},{offset}) [0|0] "" B\n'
    return body


@settings(deadline=None, max_examples=60)
@given(body=layouts())
def test_any_layout_agrees_with_cantools(tmp_path_factory: pytest.TempPathFactory, body: str) -> None:
    spec, message = _load(tmp_path_factory.mktemp("dbc"), body)
    crosscheck(spec, message, samples=100)


@pytest.mark.parametrize(
    "wrong",
    [
        {"start_bit": 13},
        {"bits": 12},
        {"factor": 0.00051},
        {"offset": 0.001},
    ],
)
def test_crosscheck_stops_on_a_specification_that_differs_from_cantools(wrong: dict[str, Any]) -> None:
    spec = FRAMES["RelativeVelocity"]
    crosscheck(spec, MESSAGES["RelativeVelocity"])
    signals = (replace(spec.signals[0], **wrong), *spec.signals[1:])
    with pytest.raises(MrctlError, match="frame RelativeVelocity, signal RelVel_FL"):
        crosscheck(replace(spec, signals=signals), MESSAGES["RelativeVelocity"])


def test_default_signals_resolve_what_the_documentation_promises() -> None:
    promised = {
        "RelVel": (0.0005, "m/s"),
        "BodyVel": (0.001, "m/s"),
        "BodyAcc": (0.01, "m/s2"),
        "CaseTemp": (0.1, "degC"),
        "Disp": (0.00005, "m"),
        "Force": (2, "N"),
        "ForceWish": (2, "N"),
        "Cur": (0.001, "A"),
    }
    signals = {signal.name: signal for spec in FRAMES.values() for signal in spec.signals}
    for (prefix, (factor, unit)), damper in itertools.product(promised.items(), ("FL", "FR", "RL", "RR")):
        signal = signals[f"{prefix}_{damper}"]
        assert (signal.factor, signal.unit, signal.bits) == (factor, unit, 13)
        assert signal.sna_raw == (-4096 if signal.signed else 8191)
