"""The DBC, read with cantools and turned into frame specifications; every fault in it said at once.

Nothing here knows the layout of `dbc/mrctl.dbc`: IDs, lengths, bit positions, scales, ranges and cycle times
are the file's own. What a DBC must keep are the names (see frames.py) and the end-to-end protection: an 8-bit
signal in byte 0 (CRC), a 4-bit one in the low nibble of byte 1 (counter), and the attribute E2EDataIDs: 16
bytes in hex, or one that holds for all counters.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from mrctl.can import codec, e2e
from mrctl.can.dbc_file import DbcFile
from mrctl.can.dbc_signal import is_protection, signal_spec
from mrctl.can.specs import FrameSpec, SignalSpec
from mrctl.errors import InputError

_DATA_IDS_MEND: Final = (
    'give it 16 bytes in hex: BA_ "E2EDataIDs" BO_ <id> "11 8E ..."; one byte holds for all counters'
)


def load_database(
    path: str | Path, required: Mapping[str, Sequence[str]] | None = None
) -> dict[str, FrameSpec]:
    """Read a DBC; give the frames that are wanted, by name.

    required: frame name -> signal names, which become `FrameSpec.signals` in that order; None takes every
    frame with all its signals. Every frame's codec has then been held against cantools. Raises InputError
    with all the problems of the file, each with its line, and MrctlError when the codec disagrees with
    cantools.
    """
    dbc = DbcFile.read(path)
    messages = dbc.messages()
    if required is None:
        required = {name: _payload(message) for name, message in messages.items()}
    specs = {}
    for name, signals in required.items():
        if name not in messages:
            mend = f"add it, or name the frame so; the file has: {', '.join(messages) or 'no frames'}"
            dbc.report(f"frame {name} is missing", mend)
        elif (spec := _frame(dbc, messages[name], signals)) is not None:
            specs[name] = spec
    if dbc.problems:
        raise InputError(dbc.problems)
    for spec in specs.values():
        _crosscheck(spec, dbc.text)
    return specs


@lru_cache(maxsize=64)
def _crosscheck(spec: FrameSpec, text: str) -> None:
    """Hold the codec of a frame against cantools, once. Raises MrctlError when they disagree."""
    codec.crosscheck(spec, DbcFile("", text).messages()[spec.name])


def _payload(message: Any) -> list[str]:  # noqa: ANN401  # cantools has no types
    return [signal.name for signal in message.signals if not is_protection(signal)]


def _frame(dbc: DbcFile, message: Any, wanted: Sequence[str]) -> FrameSpec | None:  # noqa: ANN401  # as above
    before = len(dbc.problems)
    data_ids = _data_ids(dbc, message)
    if sum(is_protection(signal) for signal in message.signals) < 2:
        dbc.report(
            f"frame {message.name} lacks E2E: an 8-bit CRC in byte 0, a counter in the low nibble of byte 1",
            "add both signals and keep the payload out of bits 0 to 11",
            message.name,
        )
    specs: dict[str, SignalSpec] = {}
    for signal in message.signals:
        spec = signal_spec(signal)
        if isinstance(spec, SignalSpec):
            specs[signal.name] = spec
        elif signal.name in wanted:
            what, mend = spec
            dbc.report(f"signal {signal.name} of {message.name} {what}", mend, message.name, signal.name)
    payload = _payload(message)
    for name in wanted:
        if name not in payload:
            mend = f"add it, or name it so; the frame has: {', '.join(payload) or 'no payload'}"
            dbc.report(f"frame {message.name} has no payload signal {name}", mend, message.name)
    if len(dbc.problems) > before:
        return None
    others = (specs[name] for name in payload if name in specs and name not in wanted)
    return FrameSpec(
        name=message.name,
        can_id=message.frame_id,
        extended=message.is_extended_frame,
        length=message.length,
        cycle_s=message.cycle_time / 1000 if message.cycle_time else None,
        data_ids=data_ids,
        signals=tuple(specs[name] for name in wanted),
        background=_background(others, message.length),
    )


def _data_ids(dbc: DbcFile, message: Any) -> bytes:  # noqa: ANN401  # cantools has no types
    attribute = message.dbc.attributes.get("E2EDataIDs")
    definition = message.dbc.attribute_definitions.get("E2EDataIDs")
    text = str(attribute.value if attribute else (definition and definition.default_value) or "")
    if not text:
        dbc.report(f"frame {message.name} has no attribute E2EDataIDs", _DATA_IDS_MEND, message.name)
        return b""
    try:
        data_ids = bytes(int(word, 16) for word in text.replace(",", " ").split())
    except ValueError:
        dbc.report(
            f"E2EDataIDs of {message.name} is not bytes in hex: {text!r}", _DATA_IDS_MEND, message.name
        )
        return b""
    if len(data_ids) == 1:
        data_ids *= e2e.COUNTERS
    if len(data_ids) != e2e.COUNTERS:
        what = f"E2EDataIDs of {message.name} has {len(data_ids)} bytes instead of {e2e.COUNTERS}"
        dbc.report(what, _DATA_IDS_MEND, message.name)
    return data_ids


def _background(others: Iterable[SignalSpec], length: int) -> bytes:
    placed = (spec.placed(spec.sna_raw, length) for spec in others if spec.sna_raw is not None)
    return sum(int.from_bytes(word) for word in placed).to_bytes(length)
