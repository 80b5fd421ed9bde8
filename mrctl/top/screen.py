"""The view as text: a screenful, from a snapshot of the watch."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from typing import Any, TextIO

from mrctl.report.tables import Cell, Value
from mrctl.report.terminal import display_width, paint, table

_STATE_TONES = {"ACTIVE": "good", "SUBSTITUTE": "warn", "LIMP": "bad", "OFF": "bad", "INIT": "warn"}
_HEADS = {
    "relative_velocity": "v rel m/s",
    "body_velocity": "v body m/s",
    "body_acceleration": "a body m/s²",
    "temperature": "°C",
    "displacement": "stroke m",
    "force_wish": "wish N",
}
_DECIMALS = {"temperature": 1, "body_acceleration": 2, "force_wish": 0}
_ESCAPE = re.compile(r"\x1b\[[0-9;]*m")


def lines(snapshot: dict[str, Any], log: Sequence[str] = (), stream: TextIO | None = None) -> list[str]:
    """The lines of the view; `log` goes below. What is not known is a dash."""
    stream = stream or sys.stdout
    out = [_title(snapshot, stream), "", *_dampers(snapshot, stream).splitlines(), ""]
    out += _loop(snapshot, stream).splitlines()
    out += ["", _rejects(snapshot, stream), "", *_frames(snapshot, stream).splitlines()]
    if log:
        out += ["", *log]
    return out


def fit(text_lines: Sequence[str], columns: int, rows: int) -> list[str]:
    """The lines cut to a terminal's size; colours do not count, and end where a line is cut."""
    return [_cut(line, columns) for line in text_lines[:rows]]


def _cut(line: str, columns: int) -> str:
    if display_width(line) <= columns:
        return line
    kept, width, place = "", 0, 0
    while place < len(line):
        code = _ESCAPE.match(line, place)
        if code:
            kept += code.group()
            place = code.end()
            continue
        width += display_width(line[place])
        if width > columns:
            break
        kept += line[place]
        place += 1
    return kept + ("\x1b[0m" if "\x1b" in kept else "")


def _title(snapshot: dict[str, Any], stream: TextIO) -> str:
    if snapshot["command_age_s"] is None:
        state = paint("no controller on the bus", "bad", stream)
    elif snapshot["alive"]:
        state = paint("commands come", "good", stream)
    else:
        state = paint(f"no command for {snapshot['command_age_s']:.1f} s", "bad", stream)
    uptime = snapshot["uptime_s"]
    up = "" if uptime is None else f"   up {'over ' if uptime >= 2540 else ''}{uptime:.0f} s"
    return f"{paint('mrctl top', 'bold', stream)}   {snapshot['channel']}   {state}{up}"


def _dampers(snapshot: dict[str, Any], stream: TextIO) -> str:
    dampers = snapshot["dampers"]
    roles = [role for role in _HEADS if any(role in damper for damper in dampers.values())]
    rows: list[list[Value | Cell]] = []
    for name, damper in dampers.items():
        state = damper["state"]
        rows.append(
            [
                name,
                Cell(state or "–", tone=_STATE_TONES.get(state or "", "soft")),  # type: ignore[arg-type]  # tones of the table
                damper["cause"] if damper["cause"] not in {None, "NONE"} else "",
                _fixed(damper["current_a"], 3),
                *(_fixed(damper.get(role), _DECIMALS.get(role, 3)) for role in roles),
                " ".join(damper["flags"]),
            ]
        )
    heads = ["damper", "state", "cause", "A", *(_HEADS[role] for role in roles), "flags"]
    return table(heads, rows, stream=stream, align="lll" + "r" * (len(roles) + 1) + "l")


def _loop(snapshot: dict[str, Any], stream: TextIO) -> str:
    late, took = snapshot["lateness_us"], snapshot["duration_us"]
    rows: list[list[Value | Cell]] = [
        ["lateness", *(_fixed(late[which], 0) for which in ("p50", "p99", "p99.9", "max"))],
        ["duration", _fixed(took["p50"], 0), _fixed(took["p99"], 0), "", _fixed(took["max"], 0)],
    ]
    heads = ["last second, µs", "p50", "p99", "p99.9", "max"]
    skipped, long_ticks = (_fixed(snapshot[key], 0) for key in ("skipped_periods", "long_ticks"))
    counts = f"since start: {skipped} periods skipped, {long_ticks} ticks longer than a period"
    return f"{table(heads, rows, stream=stream, align='lrrrr')}\n{counts}"


def _rejects(snapshot: dict[str, Any], stream: TextIO) -> str:
    reasons = {name.removeprefix("Rejected"): n for name, n in snapshot["rejected_by_reason"].items() if n}
    total = snapshot["rejected"]
    if not total and not reasons:
        return "rejected in the last second: " + ("–" if total is None else "0")
    words = ", ".join(f"{name} {n:.0f}" for name, n in reasons.items())
    return paint(f"rejected in the last second: {_fixed(total, 0)}  {words}", "warn", stream)


def _frames(snapshot: dict[str, Any], stream: TextIO) -> str:
    rows: list[list[Value | Cell]] = []
    for name, frame in snapshot["frames"].items():
        slow = frame["rate_hz"] < 0.9 * frame["expected_hz"] - 1.0
        rows.append(
            [
                frame["id"],
                name,
                Cell(f"{frame['rate_hz']:.0f}", tone="warn" if slow else None),
                f"{frame['expected_hz']:g}",
                "–" if frame["age_s"] is None else f"{1e3 * frame['age_s']:.0f}",
                Cell(str(frame["bad"]), tone="warn" if frame["bad"] else None),
                str(frame["lost"]),
            ]
        )
    heads = ["ID", "frame", "Hz", "wanted", "age ms", "bad", "lost"]
    return table(heads, rows, stream=stream, align="llrrrrr")


def _fixed(value: float | None, decimals: int) -> str:
    return "–" if value is None else f"{value:.{decimals}f}"
