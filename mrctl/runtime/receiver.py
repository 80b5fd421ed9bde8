"""One kind of input frame: length, CRC and counter checked, decoded, handed to its channels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from mrctl.can import e2e
from mrctl.can.codec import make_decoder
from mrctl.can.specs import FrameSpec
from mrctl.runtime.channel import NONE, Channel, Fault

# A step of the counter up to this is frames lost on the way; beyond it the frame is old or masqueraded.
COUNTER_STEP_MAX = 5


class FrameReceiver:
    """Takes the payloads of one CAN ID. `channels`: any number for each signal, in the frame's order."""

    __slots__ = ("_check", "_counter", "_cycle", "_data_ids", "_decode", "_length", "_rejected", "channels")

    def __init__(
        self, spec: FrameSpec, channels: Sequence[Sequence[Channel]], rejected: Counter[str], dt_s: float
    ) -> None:
        """rejected: where refused frames and values are counted, by reason. dt_s: from tick to tick."""
        # A value for each channel: a signal that nobody uses is not decoded, one with two users is twice.
        pairs = [(s, channel) for s, used in zip(spec.signals, channels, strict=True) for channel in used]
        self._decode = make_decoder(replace(spec, signals=tuple(signal for signal, _ in pairs)))
        self.channels = tuple(channel for _, channel in pairs)
        self._check = e2e.check
        self._data_ids = spec.data_ids
        self._length = spec.length
        self._cycle = 1 if spec.cycle_s is None else max(1, round(spec.cycle_s / dt_s))  # in ticks
        self._counter: int | None = None
        self._rejected = rejected

    def take(self, data: bytes, now: int) -> bool:
        """A payload that arrived in tick `now`; returns whether the frame was good (a value may not be)."""
        if len(data) != self._length:
            return self._refuse(Fault.MALFORMED)
        if not self._check(data, self._data_ids):
            return self._refuse(Fault.CRC)
        counter = data[1] & 0xF
        step = 1 if self._counter is None else (counter - self._counter) & 0xF
        if step == 0:
            return self._refuse(Fault.COUNTER)
        self._counter = counter
        if step > COUNTER_STEP_MAX:  # the next frame in order is accepted again
            return self._refuse(Fault.COUNTER)
        spanned = step * self._cycle
        for value, channel in zip(self._decode(data), self.channels):  # noqa: B905  # as many, and hot
            # What take() does with a plain next value of a signal in use, which is nearly every one.
            if channel.ok and channel.low <= value <= channel.high:
                change = value - channel.value
                if change and -channel.change_max <= change <= channel.change_max:
                    channel.value = value
                    channel.changed = channel.last = now
                    channel.until = now + channel.timeout
                    channel.fault = NONE
                    continue
            fault = channel.take(value, now, spanned)
            if fault is not NONE:
                self._rejected[fault.name.lower()] += 1
        return True

    def _refuse(self, fault: Fault) -> bool:
        self._rejected[fault.name.lower()] += 1
        for channel in self.channels:
            channel.refuse(fault)
        return False
