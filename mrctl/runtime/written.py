"""The receiver of one frame as code written for that frame: a fifth of a tick in two thirds of the time.

What `FrameReceiver.take` does in calls and in a loop stands here in a row, with the numbers of DBC and
configuration in it. For the interpreter only: in a compiled build the loop is faster than such code.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from mrctl.can.codec import code_of, crc_source, decoding_source
from mrctl.can.specs import FrameSpec
from mrctl.runtime.channel import Channel, Fault
from mrctl.runtime.receiver import COUNTER_STEP_MAX, FrameReceiver

_SOURCE = """
def make(channels, refuse, judge):
    {channels} = channels
    before = None

    def take(data, now):
        nonlocal before
        if len(data) != {length}:
            return refuse(MALFORMED)
        counter = data[1] & 0xf
        {crc}
        if data[0] != crc:
            return refuse(CRC)
        step = 1 if before is None else counter - before & 0xf
        if not 0 < step <= {step_max}:
            if step:
                before = counter
            return refuse(COUNTER)
        before = counter
        {words}
        {untils}{values}
        return True

    return take
"""
# What Channel.take does with a plain next value of a signal that is well, which is nearly every one.
_VALUE = """
        value = {value}
        if (
            {channel}.well and {low!r} <= value <= {high!r}
            and (change := value - {channel}.value) and -{most!r} <= change <= {most!r}
        ):
            {channel}.value = value
            {channel}.changed = {channel}.last = now
            {channel}.until = until{timeout}
        else:
            judge({channel}, value, now, step)"""
_LINE = "\n        "


class WrittenReceiver(FrameReceiver):
    """A receiver whose `take` is its own."""

    __slots__ = ("take",)
    take: Callable[[bytes, int], bool]  # type: ignore[assignment]  # a function, no method: cheaper to call

    def __init__(
        self, spec: FrameSpec, channels: Sequence[Sequence[Channel]], rejected: Counter[str], dt_s: float
    ) -> None:
        """As FrameReceiver."""
        super().__init__(spec, channels, rejected, dt_s)
        words, values = decoding_source(self.spec)
        named = {f"c{k}": channel for k, channel in enumerate(self.channels)}
        source = _SOURCE.format(
            channels="".join(f"{name}, " for name in named) or "()",
            length=spec.length,
            crc=_LINE.join(crc_source(spec.length, "counter")),
            step_max=COUNTER_STEP_MAX,
            words=_LINE.join(words),
            untils=_LINE.join(
                f"until{ticks} = now + {ticks}" for ticks in {c.timeout for c in self.channels}
            ),
            values="".join(
                _VALUE.format(
                    value=value,
                    channel=name,
                    low=channel.low,
                    high=channel.high,
                    most=channel.change_max,
                    timeout=channel.timeout,
                )
                for (name, channel), value in zip(named.items(), values, strict=True)
            ),
        )
        faults: dict[str, Any] = {fault.name: fault for fault in (Fault.MALFORMED, Fault.CRC, Fault.COUNTER)}
        make = code_of(source, "make", self.spec, faults)
        self.take = make(self.channels, self.refuse, self.judge)
