"""How late the loop wakes, against cyclictest on the same processors, in blocks in turn.

The loop runs as in the daemon: with all that `realtime` of the configuration asks for and the system grants,
polling before each tick included. Cyclictest runs as it is: it keeps the processors awake by itself, sleeps
to an absolute time and looks at the clock; it locks its memory where the loop's is locked.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from mrctl.bench.wire import INTERFACE, Wire, WireBus
from mrctl.can.socketcan_port import SocketCanPort
from mrctl.config import Config
from mrctl.errors import MrctlError
from mrctl.runtime import realtime
from mrctl.runtime.build import plan_of
from mrctl.runtime.histogram import Histogram
from mrctl.runtime.loop import Loop
from mrctl.runtime.tick import Tick

PRIORITY: Final = 80
BLOCK_S: Final = 2.0  # short: what the machine does besides falls on both sides alike
QUANTILES: Final = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "max": 1.0}
_HISTOGRAM_US: Final = 100_000
_BIN: Final = re.compile(r"^(\d+)\s+(\d+)\s*$", re.MULTILINE)
_OVERFLOWS: Final = re.compile(r"^# Histogram Overflows: (\d+)", re.MULTILINE)


def measure(
    config: Config, seconds: float, advance: Callable[[float], None] = lambda _: None
) -> dict[str, dict[str, float]]:
    """Quantiles in µs of the loop's and cyclictest's lateness, each side for half of the time, in turn.

    Both at the loop's rate and at SCHED_FIFO 80 where that is granted, else both without; the loop's name
    says what else was refused. Raises MrctlError where cyclictest is missing or fails.
    """
    program = cyclictest()
    fifo = _fifo_is_granted()
    period_us = round(1e6 / config.loop.rate_hz)
    ours: list[int] = []
    refused: list[str] = []
    theirs: dict[int, int] = {}
    spent = 0.0
    while spent < seconds:
        block = min(BLOCK_S, (seconds - spent) / 2.0)
        late_ns, taken = _loop_block(config, block, fifo=fifo)
        ours += late_ns
        refused = sorted(taken.refused)
        locked = "lock_memory" in taken.granted
        theirs_now = _cyclictest_block(program, period_us, block, fifo=fifo, locked=locked)
        for late_us, count in theirs_now.items():
            theirs[late_us] = theirs.get(late_us, 0) + count
        spent += 2.0 * block
        advance(2.0 * block)
    name = f"FIFO {PRIORITY}" if fifo else "no real-time priority"
    without = f", without {', '.join(refused)}" if refused else ""
    return {
        f"mrctl loop, {name}{without}": _quantiles(_binned(ours)),
        f"cyclictest, {name}": _quantiles(theirs),
    }


def cyclictest() -> str:
    """The program's path. Raises MrctlError where it is missing."""
    program = shutil.which("cyclictest")
    if program is None:
        raise MrctlError("cyclictest is not installed; apt-get install rt-tests")
    return program


def _binned(late_ns: list[int]) -> dict[int, int]:
    """Whole µs, as cyclictest counts them."""
    bins: dict[int, int] = {}
    for late in late_ns:
        us = max(late, 0) // 1000
        bins[us] = bins.get(us, 0) + 1
    return bins


def _quantiles(bins: dict[int, int]) -> dict[str, float]:
    total = sum(bins.values())
    found = {}
    for name, fraction in QUANTILES.items():
        seen = 0
        for late_us in sorted(bins):
            seen += bins[late_us]
            if seen >= fraction * total:
                found[name] = float(late_us)
                break
    return found


class _Kept(Histogram):
    """Keeps every time as it is; a histogram is right to 1/16 only."""

    __slots__ = ("times_ns",)

    def __init__(self) -> None:
        super().__init__()
        self.times_ns: list[int] = []

    def add(self, time_ns: int) -> None:
        self.times_ns.append(time_ns)
        super().add(time_ns)


def _loop_block(config: Config, seconds: float, *, fifo: bool) -> tuple[list[int], realtime.Realtime]:
    """The lateness in ns of each tick of the real loop, on a bus without a kernel, and what was granted."""
    tick = Tick(plan_of(config))
    port = SocketCanPort(WireBus(Wire(stamped=False)), INTERFACE, tick.wanted_ids)
    late = _Kept()
    wanted = config.realtime.model_copy(update={"priority": None})  # the same on both sides, see _priority
    loop = Loop(tick, port, config.loop.rate_hz, poll_us=wanted.poll_us, lateness=late)
    ticks = round(seconds * config.loop.rate_hz)
    with _priority(fifo=fifo):
        taken = realtime.enter(wanted)
        try:
            loop.run(lambda: loop.ticks + loop.skipped >= ticks)
        finally:
            realtime.leave(taken)
    return late.times_ns, taken


def _cyclictest_block(
    program: str, period_us: int, seconds: float, *, fifo: bool, locked: bool
) -> dict[int, int]:
    """Cyclictest's histogram: µs to how often."""
    loops = max(1, round(seconds * 1e6 / period_us))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "histogram"
        words = [
            program,
            "-q",
            "-t1",
            f"-i{period_us}",
            f"-l{loops}",
            f"-h{_HISTOGRAM_US}",
            f"--histfile={file}",
        ]
        words += [f"-p{PRIORITY}"] if fifo else []
        words += ["-m"] if locked else []
        done = subprocess.run(words, capture_output=True, text=True, check=False)  # noqa: S603  # its own path
        text = file.read_text(encoding="utf-8") if file.exists() else ""
    if done.returncode != 0 or not text:
        said = (done.stderr or done.stdout).strip().splitlines()
        raise MrctlError(
            f"cyclictest failed: {said[-1] if said else f'status {done.returncode}'}; try as root"
        )
    bins = {int(us): int(count) for us, count in _BIN.findall(text) if int(count)}
    overflows = _OVERFLOWS.search(text)
    if overflows and int(overflows.group(1)):
        bins[_HISTOGRAM_US] = bins.get(_HISTOGRAM_US, 0) + int(overflows.group(1))
    return bins


def _fifo_is_granted() -> bool:
    try:
        with _priority(fifo=True):
            return True
    except OSError:
        return False


@contextlib.contextmanager
def _priority(*, fifo: bool) -> Iterator[None]:
    if not fifo:
        yield
        return
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    try:
        yield
    finally:
        os.sched_setscheduler(0, *before)
