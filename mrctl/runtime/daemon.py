"""The daemon: wires configuration, bus, tick, loop, log and service manager together, and ends safely."""

from __future__ import annotations

import select
import signal
import sys
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

from mrctl.can.ports import Port, open_port
from mrctl.config import Config
from mrctl.runtime import realtime
from mrctl.runtime.build import plan_of
from mrctl.runtime.loop import Loop
from mrctl.runtime.notify import Notifier
from mrctl.runtime.reload import Reloader
from mrctl.runtime.swap import CalibrationSwap
from mrctl.runtime.tell import Teller
from mrctl.runtime.tick import Tick

# Reports to the service manager for each time-out of its watchdog: one may be lost.
REPORTS_PER_WATCHDOG = 4
# After SIGTERM the ramp gets this many times its planned length before the daemon ends all the same.
RAMP_PATIENCE = 3.0


class Daemon:
    """One controller on one bus."""

    def __init__(self, config: Config, log: Any) -> None:  # noqa: ANN401  # structlog's logger
        """Raises InputError when configuration and DBC do not go together, BusError without a usable bus."""
        self._config = config
        self._log = log
        self._notifier = Notifier()
        self._tick = Tick(plan_of(config))
        self._reloader = Reloader(config)
        bus = config.bus
        try:
            self._port: Port = open_port(
                bus.interface,
                bus.channel,
                bus.bitrate,
                bus.fd,
                self._tick.wanted_ids,
                data_bitrate=bus.data_bitrate,
                stale_after_s=min(rules.timeout_ms for rules in config.signals.values()) / 1000.0,
            )
        except BaseException:
            self._reloader.close()
            raise
        self._swap = CalibrationSwap(config, self._tick, self._reloader, log)
        rate_hz = config.loop.rate_hz
        poll_us = config.realtime.poll_us
        self._loop = Loop(self._tick, self._port, rate_hz, after_tick=self._after_tick, poll_us=poll_us)
        self._teller = Teller(config, self._tick, self._loop, self._port, self._notifier, log)
        watchdog_s = self._notifier.watchdog_s()
        self._report_every = (
            None if watchdog_s is None else max(1, round(watchdog_s / REPORTS_PER_WATCHDOG * rate_hz))
        )
        self._stop_signal: int | None = None
        self._give_up_at: float | None = None
        self._on_terminal = sys.stderr.isatty()

    def run(self, duration_s: float | None = None) -> int:
        """Run until SIGTERM, SIGINT or for duration_s; ramp to 0 A, send a last 0 A frame; exit status."""
        config, log = self._config, self._log
        handlers = {
            signal.SIGTERM: self._on_stop,
            signal.SIGINT: self._on_stop,
            signal.SIGHUP: self._on_hangup,
        }
        before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
        taken = realtime.enter(config.realtime)
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
            (log.warning if taken.refused else log.info)(
                "realtime", **taken.granted, **({"refused": taken.refused} if taken.refused else {})
            )
            self._notifier.tell("READY=1", f"STATUS=running on {config.bus.channel}")
            ends = None if duration_s is None else time.monotonic() + duration_s
            self._port.discard()  # what came while all this was set up is not fresh
            self._loop.run(self._until(ends))
        finally:
            realtime.leave(taken)
            for number, handler in before.items():
                signal.signal(number, handler)
            self._port.close()
            self._reloader.close()
        log.info(
            "stopped",
            ticks=self._loop.ticks,
            skipped=self._loop.skipped,
            unsent=self._loop.unsent,
            rejected=dict(self._tick.rejected),
            dropped=self._port.counters.dropped,
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

    def _on_stop(self, number: int, _frame: FrameType | None) -> None:
        self._stop_signal = number

    def _on_hangup(self, number: int, _frame: FrameType | None) -> None:
        """Reload; but a terminal that was closed takes its controller with it."""
        if self._on_terminal and _has_hung_up(2):
            self._stop_signal = number
        else:
            self._swap.wanted = True

    def _after_tick(self, ticks: int) -> None:
        """In the slack of each tick: the watchdog, and what there is to say."""
        if self._report_every is not None and ticks % self._report_every == 0:
            self._notifier.tell("WATCHDOG=1")
        if self._swap.active:
            self._swap.advance()
        self._teller.after_tick(ticks)


def _has_hung_up(descriptor: int) -> bool:
    poll = select.poll()
    poll.register(descriptor, 0)
    return any(events & (select.POLLHUP | select.POLLERR) for _, events in poll.poll(0))
