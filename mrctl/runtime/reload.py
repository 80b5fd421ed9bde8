"""Calibrations taken over while the controller runs: read and judged beside the tick, swapped between ticks.

SIGHUP asks for it. A helper process, forked at the start, reads the configuration and its calibrations again,
checks all as at a start, builds a whole tick of them, and hands the dampers back, their filters already at
the loop's rate. What is left for the slack of a tick, one damper at a time, takes under a millisecond.

Only the calibrations are taken over. What a running controller cannot change without a jump is refused: the
limits of the coil's current, and effects that need other signals.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from mrctl.config import Config, load_config
from mrctl.errors import MrctlError
from mrctl.model.damper import Damper
from mrctl.model.filters import FilterError
from mrctl.runtime.build import damper_needs, plan_of
from mrctl.runtime.helper import Helper
from mrctl.runtime.tick import Tick

_SIZE: Final = struct.Struct("=I")
_ASK: Final = b"?"
# What a running controller keeps as it is, and says so when the file has something else by now.
_KEPT: Final = ("bus", "database", "loop", "dampers", "control", "signals", "safety", "frames", "realtime")


@dataclass(frozen=True, slots=True)
class Reloaded:
    """What a reload brought: dampers by name, filters at the loop's rate; or why it is refused."""

    dampers: Mapping[str, Damper]
    calibrations: tuple[str, ...] = ()  # names, with the beginning of the file's SHA-256
    not_taken: tuple[str, ...] = ()  # sections of the configuration that have changed too: for a restart
    refused: str = ""


class Reloader:
    """The calibrations of a running controller, read again on demand by a helper process."""

    def __init__(self, config: Config) -> None:
        """Forks: to be made before the bus is opened."""
        self._helper = Helper(partial(_serve, config))
        self._answer = b""
        self.awaited = False

    def ask(self) -> None:
        """Ask for the files to be read again; the answer comes by `poll`."""
        with contextlib.suppress(OSError):  # a helper that has ended is found out by poll
            os.write(self._helper.to_child, _ASK)
        self._answer = b""
        self.awaited = True

    def poll(self) -> Reloaded | None:
        """The answer once it is here; never waits."""
        try:
            piece = os.read(self._helper.from_child, 1 << 16)
        except BlockingIOError:
            return None
        if not piece:
            self.awaited = False
            return Reloaded({}, refused="the helper process that reads calibrations has ended; restart")
        self._answer += piece
        if len(self._answer) < _SIZE.size:
            return None
        (size,) = _SIZE.unpack_from(self._answer)
        if len(self._answer) < _SIZE.size + size:
            return None
        self.awaited = False
        result: Reloaded = pickle.loads(self._answer[_SIZE.size :])  # noqa: S301  # from a child of this process
        return result

    def close(self) -> None:
        """End the helper."""
        self._helper.close()


def _serve(running: Config, hears: int, answers: int) -> None:
    """The helper's life: for each question the answer."""
    while os.read(hears, 1):
        data = pickle.dumps(read_again(running))
        data = _SIZE.pack(len(data)) + data
        while data:
            data = data[os.write(answers, data) :]


def read_again(running: Config) -> Reloaded:
    """Read the configuration's calibrations again and judge whether the running controller can take them."""
    try:
        now = load_config(running.path)
        refused = _unfit(running, now)
        if refused:
            return Reloaded({}, refused=refused)
        taken = replace(running, calibrations={name: now.calibrations[name] for name in running.dampers})
        Tick(plan_of(taken))
        dampers = {
            name: _at_rate(calibration.damper, running.loop.rate_hz)
            for name, calibration in taken.calibrations.items()
        }
    except (MrctlError, FilterError, ValueError) as error:
        return Reloaded({}, refused="; ".join(str(error).splitlines()))
    names = {f"{c.name} ({(c.sha256 or '')[:12]})" for c in taken.calibrations.values()}
    return Reloaded(
        dampers,
        calibrations=tuple(sorted(names)),
        not_taken=tuple(name for name in _KEPT if getattr(now, name) != getattr(running, name)),
    )


def _at_rate(damper: Damper, rate_hz: float) -> Damper:
    return replace(
        damper,
        forward_filter=damper.forward_filter.resampled(rate_hz),
        inverse_filter=damper.inverse_filter.resampled(rate_hz),
    )


def _unfit(running: Config, now: Config) -> str:
    """Why the running controller cannot take the calibrations over; empty when it can."""
    for name in running.dampers:
        if name not in now.calibrations:
            return f"{now.path} has no damper {name} any more; restart"
        old, new = running.calibrations[name].damper, now.calibrations[name].damper
        for what in ("current_max_a", "current_slew_a_s"):
            if getattr(new, what) != getattr(old, what):
                return (
                    f"damper {name}: {what} changed from {getattr(old, what):g} to {getattr(new, what):g}; "
                    "limits change with a restart only"
                )
        taken = replace(running, calibrations={**running.calibrations, name: now.calibrations[name]})
        more = damper_needs(taken, name) ^ damper_needs(running, name)
        if more:
            return f"damper {name}: its effects need other signals ({', '.join(sorted(more))}); restart"
    return ""
