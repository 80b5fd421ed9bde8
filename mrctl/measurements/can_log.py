"""A CAN log as a measurement: frames through a DBC to channels, one run a damper."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from mrctl.can import e2e
from mrctl.can.dbc_file import DbcFile
from mrctl.can.dbc_signal import signal_spec
from mrctl.can.quiet_import import cantools
from mrctl.can.specs import EXTENDED_FLAG, SignalSpec
from mrctl.errors import InputError, Problem
from mrctl.measurements.align import Sampled, align
from mrctl.measurements.assemble import RawRun
from mrctl.measurements.can_frames import Frames, read_frames
from mrctl.measurements.column_map import ColumnMap, dbc_path
from mrctl.measurements.external import DAMAGE
from mrctl.measurements.mapped import finish
from mrctl.measurements.run import BY_ATTRIBUTE, FloatArray
from mrctl.measurements.units import UNITS

# cantools has no types.
Message: TypeAlias = Any
Signal: TypeAlias = Any


def read_can_log(path: Path, data: bytes, name: str, mapping: ColumnMap) -> list[RawRun]:
    """The runs in a CAN log, one for each of the map's `dampers`. InputError with all that is wrong."""
    messages = _messages(mapping)
    dampers = mapping.model.dampers or [""]
    found = {damper: _signals(messages, mapping, damper) for damper in dampers}
    wanted = {_identifier(message) for places in found.values() for message, _ in places.values()}
    frames = read_frames(path, data, wanted, mapping.model.bus)
    runs = []
    for damper, places in found.items():
        sampled, notes = {}, [f"{count} {reason} left out" for reason, count in frames.skipped.items()]
        for attribute, (message, signal) in places.items():
            times, values = _decoded(frames, message, signal, notes)
            convert, unit = mapping.conversion(attribute, signal.unit or "")
            sampled[attribute] = Sampled(times, convert(values))
            if unit:
                notes.append(f"{BY_ATTRIBUTE[attribute].column} converted from {unit}, the unit in the DBC")
        _require_frames(path, sampled, places, frames)
        channels, said = align(path, sampled)
        run_name = f"{name}#{damper}" if damper else name
        runs.append(
            finish(RawRun(run_name, path, channels), mapping, notes=list(dict.fromkeys([*said, *notes])))
        )
    return runs


def _messages(mapping: ColumnMap) -> list[Message]:
    """The messages of the map's DBC. InputError where it names none, or one that is not sound."""
    if mapping.model.dbc is None:
        mend = "add `dbc: FILE.dbc` and `signals:` to it"
        raise InputError.at(mapping.path, "no DBC to decode a CAN log with", mend)
    return list(DbcFile.read(dbc_path(mapping)).messages().values())


def _signals(messages: list[Message], mapping: ColumnMap, damper: str) -> dict[str, tuple[Message, Signal]]:
    """Message and signal of each channel; InputError with all that the DBC does not have."""
    problems, places = [], {}
    for attribute, spec in mapping.places.items():
        wanted = str(spec.column).replace("{damper}", damper)
        message_name, _, signal_name = wanted.rpartition(".")
        hits = [
            (message, signal)
            for message in messages
            for signal in message.signals
            if signal.name == signal_name and message_name in {"", message.name}
        ]
        if len(hits) == 1:
            places[attribute] = hits[0]
            continue
        what = f"{'no' if not hits else 'more than one'} signal {wanted} in {mapping.model.dbc}"
        mend = "write MESSAGE.SIGNAL" if hits else _alike(messages, BY_ATTRIBUTE[attribute].unit)
        problems.append(Problem(str(mapping.path), None, what, mend))
    if problems:
        raise InputError(problems)
    return places


def _alike(messages: list[Message], si: str) -> str:
    """The mend: signals whose unit would fit."""
    names = [
        signal.name
        for message in messages
        for signal in message.signals
        if (unit := UNITS.get(signal.unit or "")) is not None and unit.si == si
    ]
    return f"in {si} there are {', '.join(names[:8])}" if names else "correct the name"


def _identifier(message: Message) -> int:
    return int(message.frame_id) | (EXTENDED_FLAG if message.is_extended_frame else 0)


def _require_frames(
    path: Path, sampled: dict[str, Sampled], places: dict[str, tuple[Message, Signal]], frames: Frames
) -> None:
    """InputError that names the frames which the log does not have."""
    absent = sorted({places[name][0].name for name, channel in sampled.items() if not len(channel.time_s)})
    if absent:
        what = f"has no valid frames {', '.join(absent)} among its {frames.total}"
        raise InputError.at(path, what, "is it the right DBC, log and `bus`?")


def _decoded(
    frames: Frames,
    message: Message,
    signal: Signal,
    notes: list[str],
) -> tuple[FloatArray, FloatArray]:
    """Times and values of one signal, without frames that are short, damaged or say "not available"."""
    times, payloads = frames.of(_identifier(message))
    whole = np.array([len(payload) >= message.length for payload in payloads], dtype=bool)
    _note(notes, message.name, "too short", whole)
    good = whole & _intact(message, payloads, whole, notes)
    times, payloads = times[good], [payload for payload, keep in zip(payloads, good, strict=True) if keep]
    spec = signal_spec(signal)
    if isinstance(spec, SignalSpec) and message.length <= 8:
        values = _fast(spec, payloads, message.length)
    else:
        values = np.array([_slow(message, signal.name, payload) for payload in payloads], dtype=np.float64)
    there = np.isfinite(values)
    _note(notes, signal.name, "not available", there)
    return times[there], values[there]


def _fast(spec: SignalSpec, payloads: Sequence[bytes], length: int) -> FloatArray:
    """All payloads at once: they are words of 64 bits."""
    order = ">u8" if spec.big_endian else "<u8"
    pad = bytes(8 - length)
    words = [pad + payload[:length] if spec.big_endian else payload[:length] + pad for payload in payloads]
    raw = np.frombuffer(b"".join(words), dtype=order).astype(np.uint64)
    raw = (raw >> np.uint64(spec.shift(length))) & np.uint64(spec.mask)
    signed = raw.astype(np.int64)
    if spec.signed:
        signed -= (signed >> (spec.bits - 1)) << spec.bits
    values = signed * spec.factor + spec.offset
    if spec.sna_raw is not None:
        values[signed == spec.sna_raw] = np.nan
    return np.asarray(values, dtype=np.float64)


def _slow(message: Message, name: str, payload: bytes) -> float:
    """One payload by cantools (floats, multiplexed signals, long frames); NaN where it lacks the signal."""
    try:
        value = message.decode(payload, decode_choices=False, allow_truncated=True).get(name, np.nan)
    except (cantools.database.errors.Error, *DAMAGE):
        return float("nan")
    return float(value)


def _intact(message: Message, payloads: Sequence[bytes], whole: np.ndarray, notes: list[str]) -> np.ndarray:
    """Which payloads keep their end-to-end protection, if the DBC gives them one."""
    attributes = message.dbc.attributes if message.dbc is not None else {}
    text = str(attributes["E2EDataIDs"].value) if "E2EDataIDs" in attributes else ""
    try:
        data_ids = bytes(int(word, 16) for word in text.replace(",", " ").split())
    except ValueError:
        data_ids = b""
    if len(data_ids) == 1:
        data_ids *= e2e.COUNTERS
    if len(data_ids) != e2e.COUNTERS:
        return np.ones(len(payloads), dtype=bool)
    pairs: Iterable[tuple[bytes, bool]] = zip(payloads, whole.tolist(), strict=True)
    good = np.array([not long or e2e.check(payload, data_ids) for payload, long in pairs], dtype=bool)
    _note(notes, message.name, "with a wrong CRC", good)
    return good


def _note(notes: list[str], name: str, kind: str, good: np.ndarray) -> None:
    bad = int(np.count_nonzero(~good))
    if bad:
        notes.append(f"{bad} of {len(good)} {name} {kind}, left out")
