"""The output guard: the last thing between the controller and the bus, and independent of it.

It works in the raw counts that go onto the bus and knows only what it sent before. Whatever it is given, what
leaves is a whole number of counts, in range, within the slew limit of what left last, and made in this tick.
"""

from __future__ import annotations

import math
from typing import Final

CURRENT_BOUND_A: Final = 1e6  # beyond it a number is too large to be worked with


class OutputGuard:
    """Guards the current command of one damper."""

    __slots__ = ("_fallback", "_step", "_unit_a", "maximum", "raw", "stepped_in")

    def __init__(
        self, current_max_a: float, slew_a_s: float, dt_s: float, fallback_a: float, unit_a: float
    ) -> None:
        """fallback_a: the current to go to when none can be trusted; unit_a: one count on the bus, in A.

        Raises ValueError when the slew limit is less than a count a tick: the current could never move.
        """
        self._unit_a = unit_a
        self.maximum = math.floor(current_max_a / unit_a + 1e-9)
        self._step = math.floor(slew_a_s * dt_s / unit_a + 1e-9)
        self._fallback = min(self.maximum, max(0, round(fallback_a / unit_a)))
        if self._step < 1:
            raise ValueError(
                f"a slew limit of {slew_a_s:g} A/s moves less than {unit_a:g} A in {dt_s:g} s; raise it"
            )
        self.raw = 0
        self.stepped_in = False  # since somebody last cleared it

    def apply(self, current_a: float, made_in: int, now: int) -> float:
        """The current that may leave in tick `now`, in A.

        current_a: what the controller asks for, in tick `made_in`; a stale or non-finite one is replaced
        by the fallback. One count of rounding is not called stepping in.
        """
        if made_in == now and 0.0 <= current_a <= CURRENT_BOUND_A:  # not so for NaN
            wanted = round(current_a / self._unit_a)
            if wanted <= self.maximum and -self._step <= wanted - self.raw <= self._step:
                self.raw = wanted
                return wanted * self._unit_a
        return self._step_in(current_a, trusted=made_in == now and math.isfinite(current_a))

    def _step_in(self, current_a: float, *, trusted: bool) -> float:
        """The nearest to what was asked for, or to the fallback, that may leave."""
        wanted = self._fallback
        if trusted:
            wanted = round(min(max(current_a, -CURRENT_BOUND_A), CURRENT_BOUND_A) / self._unit_a)
        low = max(0, self.raw - self._step)
        high = min(self.maximum, self.raw + self._step)
        self.raw = min(max(wanted, low), high)
        if not trusted or abs(self.raw - wanted) > 1:
            self.stepped_in = True
        return self.raw * self._unit_a
