"""What a replay costs against python-can's log reader with cantools, on the same log, in turn.

The peers: reader and decoder alone, which control nothing, and both with the control of peer.py behind them,
commands encoded with cantools.
"""

from __future__ import annotations

import gc
import tempfile
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrctl.bench.interpreted import Interpreted
from mrctl.bench.peer import PerDamper
from mrctl.bench.tick import drive
from mrctl.can.quiet_import import can, cantools
from mrctl.config import Config
from mrctl.replay.candump import CandumpReader
from mrctl.replay.run import Options, replay
from mrctl.runtime.build import input_signals
from mrctl.runtime.compiled import COMPILED

OURS, INTERPRETED, READER, READ_ONLY, WHOLE = (
    "mrctl replay",
    "mrctl replay, interpreted",
    "mrctl, its reader alone",
    "python-can + cantools, reading alone",
    "the same + numpy control",
)


@dataclass(frozen=True, slots=True)
class ReplayCost:
    """CPU seconds by side, the fastest of the rounds, for a log of so many frames and seconds."""

    frames: int
    seconds: float
    cpu_s: dict[str, float]

    def realtime_factor(self, side: str) -> float:
        """Seconds of the log in a second of CPU."""
        return self.seconds / self.cpu_s[side]


def measure(
    config: Config, ticks: int, rounds: int, advance: Callable[[], None] = lambda: None
) -> ReplayCost:
    """Make a log of so many ticks, then let the sides take turns; `advance` is called after each turn.

    In a compiled build the interpreter has its turns too, in a process of its own.
    """
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "bus.log")
        frames = _make(log, config, ticks)
        sides: dict[str, Callable[[], None]] = {
            OURS: lambda: ours(log, config),
            READER: lambda: _read(log),
            READ_ONLY: lambda: _peer_reads(log, config),
            WHOLE: lambda: _peer_controls(log, config),
        }
        taken: dict[str, list[float]] = {
            name: [] for name in (OURS, *([INTERPRETED] if COMPILED else []), *sides)
        }
        with Interpreted(config.path) if COMPILED else nullcontext() as interpreted:
            for _ in range(rounds):
                for name, run in sides.items():
                    taken[name].append(cpu_s(run))
                    advance()
                if interpreted is not None:
                    taken[INTERPRETED].append(interpreted.replay_s(log))
    return ReplayCost(
        frames, ticks / config.loop.rate_hz, {name: min(times) for name, times in taken.items()}
    )


def _make(log: Path, config: Config, ticks: int) -> int:
    """Write the log as `candump -L` does; the number of its frames."""
    frames_at, frames = drive(config), 0
    with log.open("w", encoding="ascii") as file:
        for n in range(ticks):
            seconds, rest = divmod(1_700_000_000_000_000 + round(n * 1e6 / config.loop.rate_hz), 1_000_000)
            for can_id, data in frames_at(n):
                file.write(f"({seconds}.{rest:06d}) {config.bus.channel} {can_id:03X}#{data.hex().upper()}\n")
                frames += 1
    return frames


def cpu_s(run: Callable[[], None]) -> float:
    """What one run takes, in s."""
    gc.collect()
    begin = time.process_time()
    run()
    return time.process_time() - begin


def ours(log: Path, config: Config) -> None:
    """One replay, on a grid."""
    replay(log, config, Options(clock="grid"))


def _read(log: Path) -> None:
    for _ in CandumpReader(log).parts():
        pass


def _peer_reads(log: Path, config: Config) -> None:
    database: Any = cantools.database.load_file(config.database)
    wanted = {spec.can_id for spec, _ in input_signals(config)}
    with can.CanutilsLogReader(str(log)) as messages:
        for message in messages:
            if message.arbitration_id in wanted:
                database.decode_message(message.arbitration_id, message.data)


def _peer_controls(log: Path, config: Config) -> None:
    peer, period_s = PerDamper(config), 1.0 / config.loop.rate_hz
    due: float | None = None
    waiting: list[Any] = []
    with can.CanutilsLogReader(str(log)) as messages:
        for message in messages:
            if due is None:
                due = message.timestamp + period_s / 2.0
            while message.timestamp > due:
                peer.step(waiting)
                waiting, due = [], due + period_s
            waiting.append(message)
    peer.step(waiting)
