"""The DBC as the judge needs it: which frame commands, which frames are inputs, where their signals lie."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

EXTENDED = 1 << 31
SNA = "SNA"


class UnusableError(Exception):
    """An input that nothing can be judged with; the text says what is wrong and the mend."""


@dataclass(frozen=True, slots=True)
class Signal:
    """One signal: value = raw * factor + offset."""

    name: str
    bits: tuple[int, ...]
    """Positions in the payload, least significant first: 8 * byte + bit, bit 0 the lowest."""
    signed: bool
    factor: float
    offset: float
    minimum: float | None
    maximum: float | None
    not_available: int | None
    """The raw value that says so."""

    def raw(self, word: int) -> int:
        """The raw value; word: the payload as a little-endian number."""
        first, count = self.bits[0], len(self.bits)
        if self.bits[-1] - first == count - 1:
            value = word >> first & (1 << count) - 1
        else:
            value = sum((word >> position & 1) << k for k, position in enumerate(self.bits))
        return value - (1 << count) if self.signed and value >> count - 1 else value


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame of the DBC. `identifier` has bit 31 set where it is extended."""

    name: str
    identifier: int
    length: int
    cycle_s: float | None
    data_ids: bytes
    signals: tuple[Signal, ...]
    """Without CRC and counter."""


@dataclass(frozen=True, slots=True)
class Bus:
    """The command, and the frames that its sender may hear."""

    command: Frame
    inputs: tuple[Frame, ...]


def read_dbc(path: Path, command: str = "CurrentCommand") -> Bus:
    """The frames of a DBC. Raises UnusableError."""
    import cantools.database  # noqa: PLC0415  # it takes a second: not for --help

    try:
        database: Any = cantools.database.load_file(str(path))
    except (OSError, ValueError, KeyError, cantools.database.errors.Error) as error:
        why = " ".join(str(error).split())
        raise UnusableError(f"{path}: is no DBC that can be read ({why}); give the bus's own") from error
    frames, senders = {}, {}
    for message in database.messages:
        frame = _frame(message)
        if frame is not None:
            frames[frame.name] = frame
            senders[frame.name] = set(message.senders)
    if command not in frames:
        raise UnusableError(f"{path}: has no protected frame {command}; name the command with --frame")
    inputs = [frame for name, frame in frames.items() if not senders[name] & senders[command]]
    return Bus(frames[command], tuple(inputs))


def _frame(message: Any) -> Frame | None:  # noqa: ANN401  # cantools has no types
    """The frame, or None where it is not protected end to end."""
    attribute = message.dbc.attributes.get("E2EDataIDs") if message.dbc is not None else None
    try:
        data_ids = bytes(
            int(word, 16) for word in str(attribute.value if attribute else "").replace(",", " ").split()
        )
    except ValueError:
        return None
    if len(data_ids) == 1:
        data_ids *= 16
    if len(data_ids) != 16:
        return None
    signals = tuple(_signal(signal, message.length) for signal in message.signals if min(_bits(signal)) >= 12)
    cycle_s = message.cycle_time / 1000.0 if message.cycle_time else None
    identifier = message.frame_id | (EXTENDED if message.is_extended_frame else 0)
    return Frame(message.name, identifier, message.length, cycle_s, data_ids, signals)


def _bits(signal: Any) -> tuple[int, ...]:  # noqa: ANN401  # as above
    """Positions, least significant first."""
    start, length = signal.start, signal.length
    if signal.byte_order == "little_endian":
        return tuple(range(start, start + length))
    positions = []  # Motorola: down through a byte, then on at the top of the next
    byte, bit = divmod(start, 8)
    for _ in range(length):
        positions.append(8 * byte + bit)
        byte, bit = (byte, bit - 1) if bit else (byte + 1, 7)
    return tuple(reversed(positions))


def _signal(signal: Any, _length: int) -> Signal:  # noqa: ANN401  # as above
    choices = signal.choices or {}
    missing = next((raw for raw, name in choices.items() if str(name) == SNA), None)
    return Signal(
        signal.name,
        _bits(signal),
        bool(signal.is_signed),
        float(signal.scale),
        float(signal.offset),
        None if signal.minimum is None else float(signal.minimum),
        None if signal.maximum is None else float(signal.maximum),
        missing,
    )
