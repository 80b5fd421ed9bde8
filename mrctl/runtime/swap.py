"""The running controller's side of a reload: a little in the slack of each tick, then all dampers at once."""

from __future__ import annotations

from typing import Any

from mrctl.config import Config
from mrctl.control.maps import CurrentMap, make_current_map
from mrctl.model.damper import Span
from mrctl.runtime.reload import Reloaded, Reloader
from mrctl.runtime.tick import Tick


class CalibrationSwap:
    """Follows a reload from the question to the swap; one log line at its end, either way."""

    def __init__(self, config: Config, tick: Tick, reloader: Reloader, log: Any) -> None:  # noqa: ANN401  # structlog's logger
        self._config = config
        self._tick = tick
        self._reloader = reloader
        self._log = log
        self.wanted = False  # set by a signal handler
        self._reloaded: Reloaded | None = None
        self._built: list[tuple[CurrentMap, Span]] = []

    @property
    def active(self) -> bool:
        """Whether `advance` has anything to do."""
        return self.wanted or self._reloader.awaited or self._reloaded is not None

    def advance(self) -> None:
        """One step: ask, look for the answer, build one damper's map, or swap. Never raises."""
        if self._reloaded is not None:
            self._build_or_swap(self._reloaded)
        elif self._reloader.awaited:
            answer = self._reloader.poll()
            if answer is not None and answer.refused:
                self._log.warning("calibration kept", refused=answer.refused)
            elif answer is not None:
                self._reloaded, self._built = answer, []
        elif self.wanted:
            self.wanted = False
            self._reloader.ask()

    def _build_or_swap(self, reloaded: Reloaded) -> None:
        names, control = list(self._config.dampers), self._config.control
        if len(self._built) < len(names):
            damper = reloaded.dampers[names[len(self._built)]]
            # It cannot fail: the helper has built the same.
            current_map = make_current_map(
                control.current_map, damper, 1.0 / self._config.loop.rate_hz, control.map_parameters
            )
            self._built.append((current_map, damper.temperature_valid_c))
            return
        for corner, (current_map, valid_c) in zip(self._tick.corners, self._built, strict=True):
            corner.recalibrate(current_map, valid_c)
        self._reloaded, self._built = None, []
        more = {"not_taken": list(reloaded.not_taken)} if reloaded.not_taken else {}
        self._log.info(
            "calibration taken over", tick=self._tick.now, calibrations=list(reloaded.calibrations), **more
        )
