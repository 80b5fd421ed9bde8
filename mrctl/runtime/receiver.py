"""One kind of input frame: length, CRC and counter checked, decoded, handed to its channels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from mrctl.can import e2e
from mrctl.can.reader import SignalReader
from mrctl.can.specs import FrameSpec
from mrctl.runtime.channel import NONE, Channel, Fault

# A step of the counter up to this is frames lost on the way; beyond it the frame is old or masqueraded.
COUNTER_STEP_MAX: Final = 5


class FrameReceiver:
    """Takes the payloads of one CAN ID. `channels`: any number for each signal, in the frame's order."""

    __slots__ = ("_counter", "_data_ids", "_length", "_readers", "_rejected", "channels", "cycle", "spec")

    def __init__(
        self, spec: FrameSpec, channels: Sequence[Sequence[Channel]], rejected: Counter[str], dt_s: float
    ) -> None:
        """rejected: where refused frames and values are counted, by reason. dt_s: from tick to tick."""
        # A value for each channel: a signal that nobody uses is not decoded, one with two users is twice.
        pairs = [(s, channel) for s, used in zip(spec.signals, channels, strict=True) for channel in used]
        self.spec = replace(spec, signals=tuple(signal for signal, _ in pairs))
        self.channels = tuple(channel for _, channel in pairs)
        self.cycle = 1 if spec.cycle_s is None else max(1, round(spec.cycle_s / dt_s))  # in ticks
        self._readers = tuple((SignalReader(s, spec.length), channel) for s, channel in pairs)
        self._data_ids = spec.data_ids
        self._length = spec.length
        self._counter: int | None = None
        self._rejected = rejected

    def take(self, data: bytes, now: int) -> bool:
        """A payload that arrived in tick `now`; returns whether the frame was good (a value may not be)."""
        if len(data) != self._length:
            return self.refuse(Fault.MALFORMED)
        if not e2e.check(data, self._data_ids):
            return self.refuse(Fault.CRC)
        counter = data[1] & 0xF
        step = 1 if self._counter is None else (counter - self._counter) & 0xF
        if step == 0:
            return self.refuse(Fault.COUNTER)
        self._counter = counter
        if step > COUNTER_STEP_MAX:  # the next frame in order is accepted again
            return self.refuse(Fault.COUNTER)
        for reader, channel in self._readers:
            self.judge(channel, reader.read(data), now, step)
        return True

    def judge(self, channel: Channel, value: float, now: int, step: int) -> None:
        """Hand a value to its channel. step: of the counter, from the frame before."""
        fault = channel.take(value, now, step * self.cycle)
        if fault is not NONE:
            self._rejected[fault.name.lower()] += 1

    def refuse(self, fault: Fault) -> bool:
        """Count a frame that is not good; False."""
        self._rejected[fault.name.lower()] += 1
        for channel in self.channels:
            channel.refuse(fault)
        return False
