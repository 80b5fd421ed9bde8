"""One signal of a DBC as plain data, or what is wrong with it."""

from __future__ import annotations

import math
from typing import Any, Final

from mrctl.can.specs import SignalSpec

_NOT_AVAILABLE: Final = frozenset({"sna", "signal not available", "not available"})


def is_protection(signal: Any) -> bool:  # noqa: ANN401  # cantools has no types
    """True for the CRC in byte 0 and the counter in the low nibble of byte 1."""
    little = signal.byte_order == "little_endian"
    crc = signal.length == 8 and signal.start == (0 if little else 7)
    counter = signal.length == 4 and signal.start == (8 if little else 11)
    return bool(crc or counter)


def signal_spec(signal: Any) -> SignalSpec | tuple[str, str]:  # noqa: ANN401  # cantools has no types
    """The specification of a cantools signal, or (what is wrong with it, the mend)."""
    if (fault := _unsupported(signal)) is not None:
        return fault
    lowest = -(1 << (signal.length - 1)) if signal.is_signed else 0
    highest = lowest + (1 << signal.length) - 1
    factor, offset = float(signal.scale), float(signal.offset)
    sna_raw = _sna(signal, highest)
    raw_minimum, raw_maximum = _raw_range(signal, lowest, highest)
    if sna_raw is not None and raw_minimum <= sna_raw <= raw_maximum:
        raw_minimum += sna_raw == raw_minimum
        raw_maximum -= sna_raw == raw_maximum
        if raw_minimum <= sna_raw <= raw_maximum:
            return (
                f"has its SNA value {sna_raw} inside its range",
                "choose a raw value outside minimum and maximum",
            )
    if raw_minimum > raw_maximum:
        return "has no value between its minimum and maximum", "widen the range"
    ends = sorted(raw * factor + offset for raw in (raw_minimum, raw_maximum))
    return SignalSpec(
        name=signal.name,
        start_bit=signal.start,
        bits=signal.length,
        signed=signal.is_signed,
        factor=factor,
        offset=offset,
        minimum=ends[0] if signal.minimum is None else float(signal.minimum),
        maximum=ends[1] if signal.maximum is None else float(signal.maximum),
        unit=signal.unit or "",
        sna_raw=sna_raw,
        raw_minimum=raw_minimum,
        raw_maximum=raw_maximum,
        big_endian=signal.byte_order == "big_endian",
    )


def _unsupported(signal: Any) -> tuple[str, str] | None:  # noqa: ANN401  # cantools has no types
    if signal.is_float:
        return "is an IEEE float", "make it an integer with a factor"
    if signal.is_multiplexer or signal.multiplexer_ids is not None:
        return "is multiplexed", "give it bits of its own"
    if signal.length > 52:
        return f"has {signal.length} bits", "use at most 52, which a float holds exactly"
    if not (math.isfinite(signal.scale) and math.isfinite(signal.offset) and signal.scale):
        return (
            f"has the factor {signal.scale} and offset {signal.offset}",
            "give it its resolution as the factor",
        )
    return None


def _sna(signal: Any, highest: int) -> int | None:  # noqa: ANN401  # cantools has no types
    for raw, text in (signal.choices or {}).items():
        if str(text).strip().replace("_", " ").casefold() in _NOT_AVAILABLE:
            # Some tools write the value of a signed signal without its sign.
            return int(raw) - (1 << signal.length) if raw > highest else int(raw)
    return None


def _raw_range(signal: Any, lowest: int, highest: int) -> tuple[int, int]:  # noqa: ANN401  # as above
    limits = [limit for limit in (signal.minimum, signal.maximum) if limit is not None]
    if len(limits) < 2:
        return lowest, highest
    low, high = sorted((limit - signal.offset) / signal.scale for limit in limits)
    # A limit that is a whole raw value up to the rounding of its decimal digits counts as that value.
    return max(lowest, math.ceil(low - 1e-6)), min(highest, math.floor(high + 1e-6))
