"""The fixed-step loop: the only place on the vehicle that knows the time.

The schedule is absolute: tick n is due at start + n periods, so lateness does not add up. A tick that comes
more than a period late runs once, and the periods it missed are counted and handed to the tick, which
advances its filters by as many: no bursts. Waking a process takes the system tens of microseconds: the loop
may sleep until so long before a tick is due only, and poll the clock for the rest.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

from mrctl.can.ports import PortCounters
from mrctl.runtime.histogram import Histogram
from mrctl.runtime.tick import Frame, LoopFigures, Tick

NANOSECONDS = 1_000_000_000
_FRACTIONS = (0.5, 0.99, 0.999)


class FramePort(Protocol):
    """What the loop needs of a bus."""

    counters: PortCounters

    def receive(self) -> list[Frame]:
        """All frames that have arrived; never waits."""

    def send(self, can_id: int, data: bytes) -> bool:
        """Whether the frame could be queued; never waits and never raises."""


class Loop:
    """Runs a tick at a fixed rate on a port until told to stop.

    `figures` are those of the last second; `lateness` and `duration` collect until somebody clears them.
    """

    def __init__(
        self,
        tick: Tick,
        port: FramePort,
        rate_hz: float,
        *,
        after_tick: Callable[[int], None] | None = None,
        poll_us: float = 0.0,
        lateness: Histogram | None = None,
        clock_ns: Callable[[], int] = time.monotonic_ns,
        sleep_s: Callable[[float], None] = time.sleep,
    ) -> None:
        """after_tick: called in the slack of each tick with the tick's number; must be quick.

        poll_us: polls the clock instead of sleeping for so long before a tick is due; 0 does not.
        lateness: given each tick's lateness in ns, and cleared every second.
        """
        self._tick = tick
        self._port = port
        self._period_ns = round(NANOSECONDS / rate_hz)
        self._after_tick = after_tick
        self._poll_ns = round(1e3 * poll_us)
        self._clock_ns = clock_ns
        self._sleep_s = sleep_s
        self._second = lateness or Histogram(), Histogram()
        self.lateness, self.duration = Histogram(), Histogram()
        self._window = max(1, round(rate_hz))  # the health figures are those of the last second
        self.ticks = 0
        self.skipped = 0
        self.long_ticks = 0  # that took longer than a period
        self.unsent = 0  # frames that the bus did not take
        self.figures = LoopFigures()

    def run(self, until: Callable[[], bool]) -> None:
        """Run until `until()`, asked after every tick, is true.

        ticks + skipped is the number of periods elapsed, exactly.
        """
        period, clock, wait_until = self._period_ns, self._clock_ns, self._wait_until
        tick, port = self._tick, self._port
        add_lateness, add_duration = (histogram.add for histogram in self._second)
        due = clock() + period
        while True:
            woke = wait_until(due)
            late = woke - due
            missed = 0
            if late >= period:
                missed = late // period
                self.skipped += missed
                due += missed * period
            for can_id, data in tick.step(port.receive(), 1 + missed, self.figures):
                if not port.send(can_id, data):
                    self.unsent += 1
            took = clock() - woke
            if took > period:
                self.long_ticks += 1
            add_lateness(late)
            add_duration(took)
            self.ticks += 1
            due += period
            if self.ticks % self._window == 0:
                self._end_second()
            if self._after_tick is not None:
                self._after_tick(self.ticks)
            if until():
                return

    def _wait_until(self, due: int) -> int:
        """Sleep, and poll for the rest; returns when it was over, never before `due`."""
        clock = self._clock_ns
        wait = due - self._poll_ns - clock()
        if wait > 0:
            self._sleep_s(wait / NANOSECONDS)
        woke = clock()
        while woke < due:
            woke = clock()
        return woke

    def _end_second(self) -> None:
        lateness, duration = self._second
        late, took = lateness.quantiles_us(_FRACTIONS), duration.quantiles_us(_FRACTIONS)
        self.figures = LoopFigures(
            late[0],
            late[1],
            lateness.max_us,
            self.skipped,
            late[2],
            took[0],
            took[1],
            duration.max_us,
            self.long_ticks,
            self._port.counters.dropped,
        )
        self.lateness.merge(lateness)
        self.duration.merge(duration)
        lateness.clear()
        duration.clear()
