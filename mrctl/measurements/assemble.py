"""From the channels of a file to a `Run`: complete, finite, uniform in time, missing kinematics derived."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mrctl.errors import InputError, Problem
from mrctl.measurements.averaging import averaged_over_s, note_of
from mrctl.measurements.clock import Clock, settle_clock
from mrctl.measurements.derivative import differentiate
from mrctl.measurements.integral import integrate
from mrctl.measurements.onto import onto
from mrctl.measurements.run import BY_ATTRIBUTE, KINEMATICS, FloatArray, IntArray, Run

if TYPE_CHECKING:
    from pathlib import Path

ABSURD = 1e15
"""No channel holds such a number in any unit; squares of it would still be finite."""
SAME_STEP = 0.02
"""Of a step's change to the next: nearer than this, a velocity is the step itself, but for rounding."""
MIN_ROWS = 10
"""Below this no derivative can be taken and nothing can be said about a damper."""


@dataclass(frozen=True, slots=True)
class RawRun:
    """What a reader found: channels by `Run` attribute in SI units, and their lines in the file.

    Without `time_s`, `rate_hz` gives the clock. `hint` completes the mend where a channel is missing.
    `problems` are those that the reader found already: they are raised together with what is found here.
    """

    name: str
    file: Path
    channels: dict[str, FloatArray]
    lines: IntArray | None = None
    rate_hz: float | None = None
    notes: list[str] = field(default_factory=list)
    declared: frozenset[str] = frozenset()
    hint: str = ""
    problems: Sequence[Problem] = ()

    def row(self, index: int) -> int:
        """The line of a sample; its number from 1 where the file has no lines."""
        return int(self.lines[index]) if self.lines is not None else index + 1


def assemble(raw: RawRun, *, need_force: bool = True, need_current: bool = True) -> Run:
    """The run behind raw channels. InputError with all that forbids one: missing, not finite, clock, size."""
    file = str(raw.file)
    problems = [*raw.problems, *_missing(raw, need_force=need_force, need_current=need_current)]
    count = max((len(values) for values in raw.channels.values()), default=0)
    if not problems and count < MIN_ROWS:
        what = (
            f"{raw.name} has only {count} row{'s' if count != 1 else ''}"
            if count
            else f"{raw.name} has no rows"
        )
        problems.append(
            Problem(file, None, what, f"a run needs {MIN_ROWS} at least; record longer, or remove it")
        )
    problems += _not_finite(raw)
    if problems:
        raise InputError(problems)
    channels = dict(raw.channels)
    time = channels.pop("time_s", None)
    if time is None:
        rate = raw.rate_hz or 0.0  # _missing() has seen to it that there is one
        clock = Clock(np.arange(count) / rate, rate)
    else:
        motion = next(
            channels[name]
            for name in ("velocity_m_s", "displacement_m", "acceleration_m_s2")
            if name in channels
        )
        settled, problems = settle_clock(time, motion, file, raw.row)
        if settled is None:
            raise InputError(problems)
        clock = settled
    notes, lines = list(raw.notes), raw.lines
    if time is not None and clock.resample:
        channels = {name: onto(clock.time_s, time, values, name) for name, values in channels.items()}
        if lines is not None:
            nearest = np.searchsorted(time, clock.time_s)
            lines = lines[np.clip(nearest, 0, count - 1)]
    if clock.note:
        notes.append(clock.note)
    if "current_a" not in channels and "current_command_a" in channels:
        channels["current_a"] = channels["current_command_a"]
        notes.append("current_A taken from current_command_A")
    size = len(clock.time_s)
    for name in ("force_n", "current_a"):
        channels.setdefault(name, np.full(size, np.nan))
    averaged_s = _averaged_s(channels, 1.0 / clock.rate_hz, notes)
    derived = _derive(channels, 1.0 / clock.rate_hz, notes)
    return Run(
        name=raw.name,
        file=raw.file,
        time_s=clock.time_s,
        sample_rate_hz=clock.rate_hz,
        derived=derived,
        notes=tuple(notes),
        lines=lines,
        declared=raw.declared,
        averaged_s=averaged_s,
        **{name: np.broadcast_to(values, size) for name, values in channels.items()},
    )


def _missing(raw: RawRun, *, need_force: bool, need_current: bool) -> list[Problem]:
    """A problem that lists all channels that are due and not there."""
    have = raw.channels
    wanted = []
    if "time_s" not in have and raw.rate_hz is None:
        wanted.append("time_s")
    if not any(name in have for name in KINEMATICS):
        wanted.append("velocity_m_s")
    if need_current and "current_a" not in have and "current_command_a" not in have:
        wanted.append("current_A")
    if "temperature_c" not in have:
        wanted.append("temperature_C")
    if need_force and "force_n" not in have:
        wanted.append("force_N")
    if not wanted:
        return []
    what = f"{'columns are' if len(wanted) > 1 else 'a column is'} missing: {', '.join(wanted)}"
    mend = raw.hint or "name the columns as interface names, or say with --columns MAP.yaml where they are"
    line = int(raw.lines[0]) - 1 if raw.lines is not None and len(raw.lines) else None
    return [Problem(str(raw.file), line or None, what, mend)]


def _not_finite(raw: RawRun) -> list[Problem]:
    """One problem per channel with values that are not finite, or beyond anything that is measured."""
    problems = []
    for name, values in raw.channels.items():
        bad = np.flatnonzero(~(np.abs(values) < ABSURD))
        if len(bad):
            value = values[bad[0]]
            kind = (
                "NaN"
                if np.isnan(value)
                else "infinite"
                if np.isinf(value)
                else f"{value:.3g}, no measured value"
            )
            more = f" (and so in {len(bad) - 1} more rows)" if len(bad) > 1 else ""
            what = f"{BY_ATTRIBUTE[name].column} is {kind}{more}"
            problems.append(
                Problem(str(raw.file), raw.row(int(bad[0])), what, "fill in the value, or remove the row")
            )
    return problems


def _derive(channels: dict[str, FloatArray], dt: float, notes: list[str]) -> tuple[str, ...]:
    """Fill in displacement, velocity and acceleration from one another; the names of those that were."""
    have = {name for name in KINEMATICS if name in channels}
    if "velocity_m_s" not in have:
        if "displacement_m" in have:
            channels["velocity_m_s"] = differentiate(channels["displacement_m"], dt)
            notes.append("velocity derived from displacement")
        else:
            integral = integrate(channels["acceleration_m_s2"], dt)
            channels["velocity_m_s"] = integral.values
            notes.append(f"velocity derived from acceleration: {integral.how}")
    if "displacement_m" not in have:
        integral = integrate(channels["velocity_m_s"], dt)
        channels["displacement_m"] = integral.values
        notes.append(f"displacement derived from velocity: {integral.how}")
    if "acceleration_m_s2" not in have:
        if "velocity_m_s" in have:
            channels["acceleration_m_s2"] = differentiate(channels["velocity_m_s"], dt)
            notes.append("acceleration derived from velocity")
        else:
            channels["acceleration_m_s2"] = differentiate(channels["displacement_m"], dt, order=2)
            notes.append("acceleration derived from displacement")
    return tuple(name for name in KINEMATICS if name not in have)


def _is_difference(channels: Mapping[str, FloatArray], dt: float) -> bool:
    """Whether the velocity is displacement's backward or forward difference: that is half a sample off."""
    if not {"velocity_m_s", "displacement_m"} <= channels.keys():
        return False
    velocity = channels["velocity_m_s"]
    step = np.diff(channels["displacement_m"]) / dt
    if velocity.size != step.size + 1:  # a constant
        return False
    change = float(np.linalg.norm(np.diff(step)))
    return any(np.linalg.norm(part - step) < SAME_STEP * change for part in (velocity[1:], velocity[:-1]))


def _averaged_s(channels: dict[str, FloatArray], dt: float, notes: list[str]) -> float:
    """The window in s of the moving mean that force and motion are; 0 where they are none.

    Takes a velocity out that is a step of the averaged displacement. (Elsewhere it stays: there the
    displacement may as well be the sum of the velocity.)
    """
    motion = next(channels[name] for name in KINEMATICS if name in channels)
    force = channels["force_n"]
    if not np.all(np.isfinite(force)) or motion.size != force.size:
        return 0.0
    found = averaged_over_s(force, motion, dt)
    if found:
        notes.append(note_of(found))
        if _is_difference(channels, dt):
            del channels["velocity_m_s"]
            notes.append("velocity_m_s is one step of displacement_m, half a sample off: derived anew")
    return found
