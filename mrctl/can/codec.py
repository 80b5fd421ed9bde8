"""Frame payloads to physical values and back, in code written for each frame from its DBC entry.

Called for every frame of every tick: under a microsecond for four signals, where cantools takes 5 to 12. So
each frame gets its own function, straight-line source with the constants in it. `crosscheck` holds it against
cantools.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from mrctl.can import e2e
from mrctl.can.reader import SignalReader
from mrctl.errors import MrctlError

if TYPE_CHECKING:
    from mrctl.can.specs import FrameSpec, SignalSpec

Decoder = Callable[[bytes], tuple[float, ...]]
Encoder = Callable[[Sequence[float], int], bytes]

_NAN = math.nan
# A start makes each function twice, for the check against cantools and for the tick: so it is kept.
_KEPT = 64


@lru_cache(maxsize=_KEPT)
def make_decoder(spec: FrameSpec) -> Decoder:
    """A function from the payload of a frame to its physical values, in the order of `spec.signals`.

    The payload must be `spec.length` bytes (the caller has checked that, and the CRC). A signal that says
    "not available" gives NaN; a value outside minimum and maximum is given as it is.
    """
    words, values = decoding_source(spec)
    lines = ["def decode(data):", *(f"    {line}" for line in words)]
    lines.append(f"    return ({''.join(f'{value}, ' for value in values)})")
    decoder: Decoder = code_of("\n".join(lines), "decode", spec, {})
    return decoder


def decoding_source(spec: FrameSpec) -> tuple[list[str], list[str]]:
    """The decoder's source: statements that make words of `data`, and one expression for each signal."""
    words = []
    if any(not signal.big_endian for signal in spec.signals):
        words.append("little = from_bytes(data, 'little')")
    if any(signal.big_endian for signal in spec.signals):
        words.append("big = from_bytes(data, 'big')")
    return words, [_decoding(signal, f"r{i}", spec.length) for i, signal in enumerate(spec.signals)]


@lru_cache(maxsize=_KEPT)
def make_encoder(spec: FrameSpec) -> Encoder:
    """A function from physical values (in the order of `spec.signals`) and a counter to a protected payload.

    Values saturate to the signal's range, infinities too. NaN becomes "not available"; a signal that has no
    such value gets its value closest to 0, which for a current is the safe one.
    """
    return _encoder(spec, [_encoding(signal, f"v{i}") for i, signal in enumerate(spec.signals)])


def make_raw_encoder(spec: FrameSpec) -> Encoder:
    """As make_encoder, from raw values, which must be whole and lie within raw_minimum and raw_maximum."""
    return _encoder(spec, [f"v{i}" for i in range(len(spec.signals))])


def _encoder(spec: FrameSpec, raws: Sequence[str]) -> Encoder:
    """The encoder with an expression of v0, v1, ... for each signal's raw value."""
    length = spec.length
    lines = ["def encode(values, counter):"]
    if spec.signals:
        lines.append(f"    {''.join(f'v{i}, ' for i in range(len(spec.signals)))} = values")
    lines.append("    counter &= 0xf")
    words = {"little": [f"{int.from_bytes(spec.background, 'little') & ~0xFFF:#x} | counter << 8"], "big": []}
    for signal, raw in zip(spec.signals, raws, strict=True):
        # In the background the signal's bits are 0.
        bits = f"(({raw}) & {signal.mask:#x})" if signal.signed else f"({raw})"
        words["big" if signal.big_endian else "little"].append(f"{bits} << {signal.shift(length)}")
    if words["big"]:
        lines.append(f"    big = {' | '.join(words['big'])}")
        words["little"].append(f"from_bytes(big.to_bytes({length}, 'big'), 'little')")
    lines += [
        f"    data = ({' | '.join(words['little'])}).to_bytes({length}, 'little')",
        *(f"    {line}" for line in crc_source(length, "counter")),
        "    return byte[crc] + data[1:]",
    ]
    names = {"byte": [bytes([value]) for value in range(256)]}
    encoder: Encoder = code_of("\n".join(lines), "encode", spec, names)
    return encoder


def crosscheck(spec: FrameSpec, message: Any, samples: int = 33) -> None:  # noqa: ANN401  # untyped
    """Hold decoders and encoder against cantools on about `samples` values of every signal, and its ends.

    message: the cantools message of the same frame. Raises MrctlError at the first difference: then either
    has a fault, and no frame can be trusted.
    """
    decode, encode = make_decoder(spec), make_encoder(spec)
    zeros = {signal.name: 0 for signal in message.signals}
    for index, signal in enumerate(spec.signals):
        where = f"frame {spec.name}, signal {signal.name}"
        reader = SignalReader(signal, spec.length)
        for raw in _sample(signal, samples):
            payload = message.encode(zeros | {signal.name: raw}, scaling=False, strict=False)
            theirs = message.decode(payload, decode_choices=False)[signal.name]
            mine = decode(payload)[index]
            read = reader.read(payload)
            if (mine != theirs or read != theirs) and not (
                math.isnan(mine) and math.isnan(read) and raw == signal.sna_raw
            ):
                raise MrctlError(
                    f"{where}, raw {raw}: read as {mine} and {read}, by cantools as {theirs}; report this"
                )
            if not signal.raw_minimum <= raw <= signal.raw_maximum and raw != signal.sna_raw:
                continue
            values = [_NAN] * len(spec.signals)
            values[index] = mine
            sent = message.decode(encode(values, raw), decode_choices=False, scaling=False)[signal.name]
            if sent != raw:
                raise MrctlError(f"{where}, value {mine}: sent as raw {sent} instead of {raw}; report this")


def _decoding(signal: SignalSpec, name: str, length: int) -> str:
    word = "big" if signal.big_endian else "little"
    raw = f"({name} := {word} >> {signal.shift(length)} & {signal.mask:#x})"
    first, number = "", raw
    if signal.sna_raw is not None:
        first, number = f"nan if {raw} == {signal.sna_raw & signal.mask:#x} else ", name
    if signal.signed:
        number = f"({name} if {number} < {1 << signal.bits - 1:#x} else {name} - {1 << signal.bits:#x})"
    offset = f" + {signal.offset!r}" if signal.offset else ""
    return f"{first}{number} * {signal.factor!r}{offset}"


def _encoding(signal: SignalSpec, name: str) -> str:
    limits = [(raw * signal.factor + signal.offset, raw) for raw in (signal.raw_minimum, signal.raw_maximum)]
    (low, raw_at_low), (high, raw_at_high) = sorted(limits)
    nothing = signal.sna_raw
    if nothing is None:
        nothing = min(max(round(-signal.offset / signal.factor), signal.raw_minimum), signal.raw_maximum)
    shifted = f"({name} - {signal.offset!r})" if signal.offset else name
    return (
        f"round({shifted} / {signal.factor!r}) if {low!r} < {name} < {high!r} else "
        f"{raw_at_high} if {name} >= {high!r} else {raw_at_low} if {name} <= {low!r} else {nothing}"
    )


def crc_source(length: int, counter: str) -> list[str]:
    """Statements that work out `crc` for `data` with this counter: e2e.crc, unrolled for most frames."""
    if length != 8:
        return [f"crc = crc_of(data, data_ids[{counter}])"]
    remainder = "0xff"
    for k in range(1, length):
        remainder = f"table[{remainder} ^ b{k}]"
    names = ", ".join(f"b{k}" for k in range(length))
    return [f"{names} = data", f"crc = table[{remainder} ^ data_ids[{counter}]] ^ 0xff"]


def code_of(source: str, name: str, spec: FrameSpec, names: dict[str, Any]) -> Any:  # noqa: ANN401  # new
    """What `source`, made of numbers and the names known here, defines as `name`, for a frame."""
    scope = {
        "from_bytes": int.from_bytes,
        "nan": _NAN,
        "inf": math.inf,
        "crc_of": e2e.crc,
        "table": e2e.CRC8_2F,
        "data_ids": spec.data_ids,
        **names,
    }
    code = compile(source, f"<{name} {spec.name}>", "exec")
    exec(code, scope)  # noqa: S102  # the source is made here, of numbers only; no text of the DBC gets in
    return scope[name]


def _sample(signal: SignalSpec, count: int) -> Iterator[int]:
    first = -(1 << (signal.bits - 1)) if signal.signed else 0
    last = first + signal.mask
    marks = {first, first + 1, 0, 1, last - 1, last, signal.raw_minimum, signal.raw_maximum}
    if signal.sna_raw is not None:
        marks.add(signal.sna_raw)
    marks.update(range(first, last, max(signal.mask // count, 1)))
    yield from sorted(raw for raw in marks if first <= raw <= last)
