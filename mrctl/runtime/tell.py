"""What the daemon says of itself: changes of state and of the link, rejected frames, statistics."""

from __future__ import annotations

from collections import Counter
from typing import Any

from mrctl.can.frames import State
from mrctl.can.ports import Port
from mrctl.config import Config
from mrctl.runtime.histogram import Histogram
from mrctl.runtime.loop import Loop
from mrctl.runtime.notify import Notifier
from mrctl.runtime.tick import StateChange, Tick

STATUS_EVERY_S = 10.0
STATISTICS_EVERY_S = 60.0
REJECTED_EVERY_S = 1.0
_NAMES = ("p50", "p99", "p999")


class Teller:
    """Lines for the log and words for the service manager, in the slack of the tick."""

    def __init__(
        self,
        config: Config,
        tick: Tick,
        loop: Loop,
        port: Port,
        notifier: Notifier,
        log: Any,  # noqa: ANN401  # structlog's logger
    ) -> None:
        self._config, self._tick, self._loop, self._port = config, tick, loop, port
        self._notifier, self._log = notifier, log
        rate_hz = config.loop.rate_hz
        self._status_every, self._statistics_every, self._rejected_every = (
            max(1, round(seconds * rate_hz))
            for seconds in (STATUS_EVERY_S, STATISTICS_EVERY_S, REJECTED_EVERY_S)
        )
        self._rejected_before: Counter[str] = Counter()
        self._at_last_minute = {"ticks": 0, "skipped": 0, "unsent": 0}
        self._rejected_at_last_minute: Counter[str] = Counter()

    def after_tick(self, ticks: int) -> None:
        """Say what there is to say."""
        changes = self._tick.changes
        if changes:
            self._say_changes(changes)
            changes.clear()
        for event in self._port.take_events():
            self._log.warning(event.kind, detail=event.detail)
        if ticks % self._rejected_every == 0:
            self._say_rejected()
            if ticks % self._status_every == 0:
                self._say_status()
            if ticks % self._statistics_every == 0:
                self._say_statistics()

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

    def _say_rejected(self) -> None:
        rejected = self._tick.rejected
        if rejected != self._rejected_before:
            self._log.warning("rejected frames", **(rejected - self._rejected_before))
            self._rejected_before = rejected.copy()

    def _states(self) -> dict[str, str]:
        return {
            name: corner.state.name
            for name, corner in zip(self._config.dampers, self._tick.corners, strict=True)
        }

    def _say_status(self) -> None:
        states = ", ".join(f"{name} {state}" for name, state in self._states().items())
        late_us = self._loop.figures.lateness_p99_us
        self._notifier.tell(f"STATUS={states}; late p99 {late_us:.0f} us; {self._loop.skipped} skipped")

    def _say_statistics(self) -> None:
        loop, counters = self._loop, self._port.counters
        now = {"ticks": loop.ticks, "skipped": loop.skipped, "unsent": loop.unsent}
        self._log.info(
            "statistics",
            **{name: count - self._at_last_minute[name] for name, count in now.items()},
            **_times("lateness", loop.lateness),
            **_times("duration", loop.duration),
            long_ticks=loop.long_ticks,
            rejected=dict(self._tick.rejected - self._rejected_at_last_minute),
            dropped=counters.dropped,
            stale=counters.stale,
            link_down=counters.down,
            states=self._states(),
        )
        self._at_last_minute = now
        self._rejected_at_last_minute = self._tick.rejected.copy()
        loop.lateness.clear()
        loop.duration.clear()


def _times(name: str, histogram: Histogram) -> dict[str, float]:
    quantiles = histogram.quantiles_us((0.5, 0.99, 0.999))
    times = {f"{name}_{which}_us": round(us, 1) for which, us in zip(_NAMES, quantiles, strict=True)}
    return times | {f"{name}_max_us": round(histogram.max_us, 1)}
