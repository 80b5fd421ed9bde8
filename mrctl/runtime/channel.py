"""One input signal of one damper: whether what arrives is plausible, and whether it is fresh."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Final


class Fault(IntEnum):
    """Why a signal is not used; the order is that of the fault codes on the bus."""

    NONE = 0
    MISSING = 1
    NOT_AVAILABLE = 2
    CRC = 3
    COUNTER = 4
    RANGE = 5
    RATE = 6
    MALFORMED = 7
    FROZEN = 8  # on the bus as RATE


NONE: Final = Fault.NONE
# Below this share of its range, a value may stay the same for as long as it likes: the car stands.
AT_REST_SHARE: Final = 0.01
NEVER: Final = -(1 << 60)  # a tick so long ago that every time-out has passed since


@dataclass(frozen=True, slots=True)
class ChannelRules:
    """What a signal must keep to. Times in s, limits in the signal's unit, rate_max in unit per s."""

    timeout_s: float
    minimum: float
    maximum: float
    rate_max: float
    limp_after_s: float | None  # how long a substitute will do after the signal was good; None: for ever
    frozen_after_s: float | None = None  # exactly the same for longer, it is frozen; None: not judged


class Channel:
    """The last good value of a signal, its age, and whether it may be used.

    A signal is used (`ok`) after a run of good values and until its last good one is older than its time-out.
    One bad value in between is passed over: the last good one stands in. The change that is plausible grows
    with the time since then, so no jump, however large, locks a signal out for good.
    """

    __slots__ = (
        "_at_rest",
        "_bridging",
        "_frozen_after",
        "_limp_after",
        "_run",
        "_run_wanted",
        "change_max",
        "changed",
        "fault",
        "high",
        "last",
        "low",
        "ok",
        "timeout",
        "until",
        "value",
        "well",
    )

    def __init__(self, rules: ChannelRules, dt_s: float, good_frames: int, start: float = 0.0) -> None:
        """start: value before any arrives; good_frames: good ones in a row that make the signal usable."""
        self.low = rules.minimum
        self.high = rules.maximum
        self.change_max = rules.rate_max * dt_s
        self.timeout = max(1, round(rules.timeout_s / dt_s))  # in ticks
        self._limp_after = None if rules.limp_after_s is None else round(rules.limp_after_s / dt_s)
        self._frozen_after = (
            -NEVER if rules.frozen_after_s is None else max(1, round(rules.frozen_after_s / dt_s))
        )
        self._at_rest = AT_REST_SHARE * max(abs(rules.minimum), abs(rules.maximum))
        self.changed = 0  # tick when the value became what it is
        self._run_wanted = good_frames
        self._run = 0  # good values in a row since the signal was last usable
        self.value = start
        self.last = NEVER  # tick of the last good value
        self.ok = False
        self.until = NEVER  # last tick in which the signal may be used, if nothing more arrives
        self._bridging = False  # was ok, and not gone for too long since
        self.fault = Fault.MISSING
        self.well = False  # ok, and nothing was refused since the last good value

    def take(self, value: float, now: int, spanned: int = 1) -> Fault:
        """A value that arrived in tick `now`; returns why it is refused, or NONE.

        spanned: ticks from the frame before to this one as they were sent; frames that were held up on the
        way come in one tick, and are no jump.
        """
        if self.low <= value <= self.high:  # not so for NaN
            change = value - self.value
            # Nearly always within what one tick allows; only else it matters how long it has been.
            if -self.change_max <= change <= self.change_max or abs(change) <= self.change_max * max(
                now - self.last + 1, spanned
            ):
                if value != self.value:
                    self.value = value
                    self.changed = now
                elif now - self.changed >= self._frozen_after and abs(value) > self._at_rest:
                    return self.refuse(Fault.FROZEN)
                self.last = now
                if self.ok:
                    self.fault = NONE
                    self.well = True
                    self.until = now + self.timeout
                else:  # what was wrong stays the cause until the run is long enough
                    self._run += 1
                return NONE
            return self.refuse(Fault.RATE)
        return self.refuse(Fault.NOT_AVAILABLE if math.isnan(value) else Fault.RANGE)

    def refuse(self, fault: Fault) -> Fault:
        """Note that a frame or value was refused: the run of good ones ends."""
        self.fault = fault
        self.well = False
        self._run = 0
        return fault

    def update(self, now: int) -> bool:
        """Whether the signal may be used in tick `now`."""
        if now - self.last > self.timeout:
            self.ok = self.well = False
            self.until = NEVER
            self._run = 0
            if self.fault is NONE:
                self.fault = Fault.MISSING
        elif not self.ok and self._run >= self._run_wanted:
            self.ok = self.well = self._bridging = True
            self.until = self.last + self.timeout
            self.fault = NONE
        return self.ok

    def substitutable(self, now: int) -> bool:
        """Whether, not ok, the signal may still be stood in for; if once not, not until it is ok again."""
        if self._limp_after is None:
            return True
        if self._bridging and now - self.last > self._limp_after:
            self._bridging = False
        return self._bridging
