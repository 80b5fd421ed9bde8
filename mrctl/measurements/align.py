"""Channels that were sampled at their own times, onto one even clock.

The clock is that of the force (else of the motion) over the time that all channels cover. Sensors are
interpolated along straight lines; what a driver was asked for is held until the next value, as the driver
does (`onto`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrctl.errors import InputError, Problem
from mrctl.measurements.assemble import MIN_ROWS
from mrctl.measurements.clock import GAP_SAMPLES
from mrctl.measurements.onto import is_held, onto
from mrctl.measurements.run import BY_ATTRIBUTE, FloatArray

_CLOCK = ("force_n", "velocity_m_s", "displacement_m", "acceleration_m_s2")
_SLOW = ("temperature_c", "fluid_temperature_c")


@dataclass(frozen=True, slots=True)
class Sampled:
    """One channel: times in s, not falling, and values in SI, both (n,)."""

    time_s: FloatArray
    values: FloatArray


def align(path: Path, sampled: Mapping[str, Sampled]) -> tuple[dict[str, FloatArray], list[str]]:
    """All channels (by attribute of `Run`) on one clock from 0, and notes on how. InputError on gaps."""
    problems = _problems(path, sampled)
    if problems:
        raise InputError(problems)
    sampled = {name: _without_repeats(channel) for name, channel in sampled.items()}
    leader = next((name for name in _CLOCK if name in sampled), next(iter(sampled)))
    step = float(np.median(np.diff(sampled[leader].time_s)))
    start = max(float(channel.time_s[0]) for channel in sampled.values())
    moving = [channel for name, channel in sampled.items() if name in _CLOCK]
    end = min(float(channel.time_s[-1]) for channel in (moving or sampled.values()))
    if end - start < MIN_ROWS * step:
        what = f"the channels have no more than {max(0.0, end - start):.3g} s in common"
        raise InputError.at(path, what, "are they from the same recording?")
    places = np.arange(int((end - start) / step * (1 + 1e-12)) + 1, dtype=np.float64)
    grid = start + step * places
    channels = {name: onto(grid, channel.time_s, channel.values, name) for name, channel in sampled.items()}
    held = ", ".join(
        BY_ATTRIBUTE[name].column
        for name, channel in sampled.items()
        if is_held(grid, channel.time_s, channel.values, name)
    )
    note = f"on the clock of {BY_ATTRIBUTE[leader].column}, {1 / step:.6g} Hz; other channels interpolated"
    notes = [note + (f", {held} held" if held else ""), f"time_s counts from {start:.6f} s of the recording"]
    return {"time_s": grid - start, **channels}, notes


def _problems(path: Path, sampled: Mapping[str, Sampled]) -> list[Problem]:
    """Channels that are empty, run backwards, or pause for too long."""
    problems = []
    for name, channel in sampled.items():
        column, time = BY_ATTRIBUTE[name].column, channel.time_s
        if len(time) < (1 if name in _SLOW or BY_ATTRIBUTE[name].held else MIN_ROWS):
            what = f"{column} has {len(time) or 'no'} samples"
            problems.append(Problem(str(path), None, what, "is it the right channel of the right recording?"))
            continue
        steps = np.diff(time) if len(time) > 1 else np.ones(1)
        back = np.flatnonzero(steps < 0)
        if len(back):
            what = f"time of {column} goes backwards at {time[back[0] + 1]:.6f} s"
            problems.append(
                Problem(str(path), int(back[0]) + 2, what, "export the recording again, in order")
            )
            continue
        wide = np.flatnonzero(steps > GAP_SAMPLES * np.median(steps))
        if name in _CLOCK and len(wide):
            at = int(wide[0])
            more = f" (and {len(wide) - 1} more)" if len(wide) > 1 else ""
            what = f"a gap: no {column} from {time[at]:.6f} to {time[at + 1]:.6f} s{more}"
            problems.append(Problem(str(path), at + 2, what, "cut the recording at the gap"))
    return problems


def _without_repeats(channel: Sampled) -> Sampled:
    """Of several samples with the same stamp, the last."""
    last = np.append(np.diff(channel.time_s) > 0, [True])
    return channel if last.all() else Sampled(channel.time_s[last], channel.values[last])
