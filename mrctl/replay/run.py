"""One log through the controller: from a file to a result."""

from __future__ import annotations

import gc
import itertools
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrctl.config import Config
from mrctl.errors import InputError
from mrctl.replay.clocks import Origin, RecordedClock, origin, run_on_grid
from mrctl.replay.differences import GRID_TOLERANCE_TICKS, Differences
from mrctl.replay.output import CandumpWriter
from mrctl.replay.player import Observer, Player, sent_ids
from mrctl.replay.rows import NANOSECONDS
from mrctl.replay.source import GAP_MAX_NS, Frames, LogSource, Wanted, open_log
from mrctl.runtime.build import plan_of

CLOCKS = ("auto", "recorded", "grid")
# So much of a log is looked at to find out whether it has commands.
PEEK_NS = 5 * NANOSECONDS


@dataclass(frozen=True, slots=True)
class Options:
    """How to replay; the defaults suit a log of `candump -L`."""

    interface: str | None = None
    stamps: str = "auto"
    clock: str = "auto"
    start_s: float | None = None
    """On the grid: when the controller starts, in the log's time; None: half a period before the first."""
    opened_before_s: float = 0.0
    latency_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Result:
    """What a replay gave: `figures` as they stand in JSON, and sentences for a person."""

    figures: dict[str, Any]
    notes: tuple[str, ...]


def replay(
    path: Path,
    config: Config,
    options: Options | None = None,
    *,
    out: Path | None = None,
    observer: Observer | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Result:
    """Replay one log.

    out: the frames that the controller sends, as candump writes them. progress: told the share that is done.
    Raises InputError where the log holds nothing usable.
    """
    options = options or Options()
    began = time.perf_counter()
    plan = plan_of(config)
    wanted = Wanted(
        frozenset(spec.linux_id for spec, _ in plan.frames_in),
        sent_ids(plan),
        config.bus.channel,
        config.bus.fd,
    )
    reader = open_log(path, options.stamps)
    source = LogSource(path, reader, wanted, options.interface)
    with ExitStack() as stack:
        stack.enter_context(_no_collection())
        writer = None if out is None else stack.enter_context(CandumpWriter(out, source))
        player = Player(plan, writer, observer)
        differences = Differences(plan.command, plan.state)
        clock = _play(source, player, differences, options, config, progress)
    took_s = time.perf_counter() - began
    differences.finish()
    return _result(path, source, player, differences, clock, took_s)


def _play(
    source: LogSource,
    player: Player,
    differences: Differences,
    options: Options,
    config: Config,
    progress: Callable[[float], None],
) -> dict[str, Any]:
    """Run the clock that fits; says which, and what is to be known of it."""
    parts = _told(source, progress)
    peeked = next(parts, [])
    begin: Origin | None = None
    if options.clock != "grid":
        begin = origin(peeked, player, source.first_ns or 0)
        while begin is None and (not peeked or peeked[-1][0] - peeked[0][0] <= PEEK_NS):
            following = next(parts, None)
            if following is None:
                break
            begin = origin(following, player, source.first_ns or 0)
            peeked += following
    whole = itertools.chain([peeked], parts)
    if begin is None:
        if options.clock == "recorded" and peeked:
            what = f"has no command of the controller in its first {PEEK_NS / NANOSECONDS:g} s"
            raise InputError.at(source.path, what, "use --clock grid")
        differences.tolerate(GRID_TOLERANCE_TICKS)
        # Frames that come with the ticks' own period then fall between two ticks, not on one.
        start_ns = (source.first_ns or 0) - player.period_ns // 2
        if options.start_s is not None:
            start_ns = _start_ns(source, options.start_s)
        run_on_grid(whole, player, differences, start_ns)
        return {"kind": "grid", "start_ns": start_ns}
    if not begin.started_in_log:
        # Time for the signals to appear, and as much for filters and estimates to forget where they began.
        differences.settled_ns = (source.first_ns or 0) + round(2.0 * config.safety.init_timeout_s * 1e9)
        source.notes.append(
            "the controller ran before the log began: its commands are compared from "
            f"{2.0 * config.safety.init_timeout_s:g} s on"
        )
    clock = RecordedClock(
        player, differences, begin, round(options.opened_before_s * 1e9), round(options.latency_s * 1e9)
    )
    clock.run(whole)
    return {"kind": "recorded", "start_ns": begin.start_ns, "too_early": clock.too_early}


def _start_ns(source: LogSource, start_s: float) -> int:
    """A start that was given, held against the log. Raises InputError where it is far from it."""
    first_ns = source.first_ns or 0
    if not abs(start_s - first_ns / NANOSECONDS) <= GAP_MAX_NS / NANOSECONDS:  # not so for NaN
        what = f"begins at {first_ns / NANOSECONDS:.6f} s, far from a start at {start_s:g} s"
        raise InputError.at(source.path, what, "give --start in the log's own time")
    return round(start_s * 1e6) * 1000


def _told(source: LogSource, progress: Callable[[float], None]) -> Iterator[Frames]:
    for part in source.frames():
        progress(source.share())
        yield part


@contextmanager
def _no_collection() -> Iterator[None]:
    """No garbage collection: a replay makes no cycles, and many frames."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _result(
    path: Path,
    source: LogSource,
    player: Player,
    differences: Differences,
    clock: dict[str, Any],
    took_s: float,
) -> Result:
    counts, tally, start_ns = source.counts, differences.tally, clock["start_ns"]
    rejected: Counter[str] = player.tick.rejected + counts.rejected + source.unread
    seconds = player.tick.now * player.period_ns / 1e9
    first = tally.first_differing_ns
    figures = {
        "log": str(path),
        "interface": source.interface,
        "frames": counts.frames,
        "ticks": player.ticks,
        "commands": player.commands,
        "rejected": dict(sorted(rejected.items())),
        "differences": tally.differing,
        "realtime_factor": round(seconds / took_s, 2) if took_s > 0.0 else None,
        "seconds": round(seconds, 9),
        "skipped": player.skipped,
        "clock": clock["kind"],
        "start_s": start_ns / 1e9,
        "compared": {
            "commands": tally.compared,
            "same_bytes": tally.same_bytes,
            "largest_difference_a": tally.largest_a,
            "first_difference_s": None if first is None else (first - start_ns) / 1e9,
            "tolerance_ticks": differences.tolerance_ticks,
            "left_out_unsettled": differences.unsettled,
            "left_out_after_shut_down": differences.after_shut_down,
            "left_out_damaged": differences.damaged,
        },
        "traffic": {
            "read": counts.used,
            "sent_by_controller": counts.own,
            "foreign": counts.foreign,
            "other_interfaces": counts.other_interfaces,
            "before_start": clock.get("too_early", 0),
            "bus_off": counts.bus_off,
        },
        "log_clock": {
            "sorted_frames": counts.sorted,
            "wrong_stamps": counts.wrong_stamps,
            "steps_back": counts.steps_back,
            "gaps_cut": counts.gaps_cut,
            "cut_s": counts.cut_s,
        },
        "states_s": player.seconds_in_state(),
        "state_changes": player.changed,
        "changes": [
            {
                "time_s": (time_ns - start_ns) / 1e9,
                "damper": change.damper,
                "before": change.before.name,
                "after": change.after.name,
                "cause": change.cause,
            }
            for time_ns, change in player.changes
        ],
        "notes": list(source.notes),
    }
    return Result(figures, tuple(source.notes))
