"""The daemon: wires configuration, bus, tick, loop, log and service manager together, and ends safely."""

from __future__ import annotations

import gc
import signal
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

from mrctl.can.frames import State
from mrctl.can.ports import Port, open_port
from mrctl.config import Config
from mrctl.runtime.build import plan_of
from mrctl.runtime.loop import Loop
from mrctl.runtime.notify import Notifier
from mrctl.runtime.tick import StateChange, Tick

# Reports to the service manager for each time-out of its watchdog: one may be lost.
REPORTS_PER_WATCHDOG = 4
# After SIGTERM the ramp gets this many times its planned length before the daemon ends all the same.
RAMP_PATIENCE = 3.0
STATUS_EVERY_S = 10.0


class Daemon:
    """One controller on one bus."""

    def __init__(self, config: Config, log: Any) -> None:  # noqa: ANN401  # structlog's logger
        """Raises InputError when configuration and DBC do not go together, BusError without a usable bus."""
        self._config = config
        self._log = log
        self._notifier = Notifier()
        self._tick = Tick(plan_of(config))
        bus = config.bus
        self._port: Port = open_port(
            bus.interface,
            bus.channel,
            bus.bitrate,
            bus.fd,
            self._tick.wanted_ids,
            data_bitrate=bus.data_bitrate,
        )
        rate_hz = config.loop.rate_hz
        self._loop = Loop(self._tick, self._port, rate_hz, after_tick=self._after_tick)
        watchdog_s = self._notifier.watchdog_s()
        self._report_every = (
            None if watchdog_s is None else _ticks(watchdog_s / REPORTS_PER_WATCHDOG, rate_hz)
        )
        self._status_every = _ticks(STATUS_EVERY_S, rate_hz)
        self._stop_signal: int | None = None
        self._give_up_at: float | None = None
        self._rejected_before: dict[str, int] = {}

    def run(self, duration_s: float | None = None) -> int:
        """Run until SIGTERM, SIGINT or for duration_s; ramp to 0 A, send a last 0 A frame; exit status."""
        config, log = self._config, self._log
        before = {
            number: signal.signal(number, self._on_signal) for number in (signal.SIGTERM, signal.SIGINT)
        }
        # The tick makes no reference cycles; a collection in the middle of it would cost milliseconds.
        gc.collect()
        gc.freeze()
        gc.disable()
        try:
            log.info(
                "running",
                channel=config.bus.channel,
                rate_hz=config.loop.rate_hz,
                law=config.control.law,
                current_map=config.control.current_map,
                dampers=list(config.dampers),
                calibrations=sorted({c.name for c in config.calibrations.values()}),
            )
            self._notifier.tell("READY=1", f"STATUS=running on {config.bus.channel}")
            ends = None if duration_s is None else time.monotonic() + duration_s
            self._loop.run(self._until(ends))
        finally:
            gc.enable()
            gc.unfreeze()
            for number, handler in before.items():
                signal.signal(number, handler)
            self._port.close()
        log.info(
            "stopped",
            ticks=self._loop.ticks,
            skipped=self._loop.skipped,
            unsent=self._loop.unsent,
            rejected=dict(self._tick.rejected),
            at_rest=self._tick.at_rest,
        )
        return 0 if self._tick.at_rest else 1

    def _until(self, ends: float | None) -> Callable[[], bool]:
        def done() -> bool:
            if self._give_up_at is None:
                if self._stop_signal is None and (ends is None or time.monotonic() < ends):
                    return False
                self._begin_to_stop()
            elif self._tick.at_rest:
                return True
            return self._give_up_at is not None and time.monotonic() > self._give_up_at

        return done

    def _begin_to_stop(self) -> None:
        name = "duration over" if self._stop_signal is None else signal.Signals(self._stop_signal).name
        self._log.info("stopping", why=name)
        self._notifier.tell("STOPPING=1", "STATUS=ramping to 0 A")
        self._tick.shut_down()
        self._give_up_at = time.monotonic() + RAMP_PATIENCE * self._config.safety.off_ramp_s + 1.0

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        self._stop_signal = number

    def _after_tick(self, ticks: int) -> None:
        """In the slack of each tick: the watchdog, and what there is to say."""
        if self._report_every is not None and ticks % self._report_every == 0:
            self._notifier.tell("WATCHDOG=1")
        changes = self._tick.changes
        if changes:
            self._say_changes(changes)
            changes.clear()
        for event in self._port.take_events():
            self._log.warning(event.kind, detail=event.detail)
        if ticks % self._status_every == 0:
            self._say_status()

    def _say_changes(self, changes: list[StateChange]) -> None:
        """One line for all dampers that went the same way for the same cause."""
        together: dict[tuple[State, State, str], list[StateChange]] = {}
        for change in changes:
            together.setdefault((change.before, change.after, change.cause), []).append(change)
        for (before, after, cause), same in together.items():
            self._log.info(
                "state",
                before=before.name,
                after=after.name,
                cause=cause,
                dampers=[change.damper for change in same],
                tick=same[-1].tick,
            )

    def _say_status(self) -> None:
        states = ", ".join(
            f"{name} {corner.state.name}"
            for name, corner in zip(self._config.dampers, self._tick.corners, strict=True)
        )
        figures = self._loop.figures
        self._notifier.tell(
            f"STATUS={states}; late p99 {figures.lateness_p99_us:.0f} us; {self._loop.skipped} skipped"
        )
        rejected = dict(self._tick.rejected)
        if rejected != self._rejected_before:
            new = {k: n - self._rejected_before.get(k, 0) for k, n in rejected.items()}
            self._log.warning("rejected frames", **{k: n for k, n in new.items() if n})
            self._rejected_before = rejected


def _ticks(seconds: float, rate_hz: float) -> int:
    return max(1, round(seconds * rate_hz))
