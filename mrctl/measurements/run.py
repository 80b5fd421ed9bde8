"""What a measurement is, once it is read: a run, a campaign of runs, and the names of their channels."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from pathlib import Path

    from mrctl.errors import Problem

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel: attribute of `Run`, name in a CSV header, SI unit; `held` between samples or a line."""

    attribute: str
    column: str
    unit: str
    held: bool = False


CHANNELS = (
    Channel("time_s", "time_s", "s"),
    Channel("velocity_m_s", "velocity_m_s", "m/s"),
    Channel("current_a", "current_A", "A", held=True),
    Channel("temperature_c", "temperature_C", "degC"),
    Channel("force_n", "force_N", "N"),
    Channel("displacement_m", "displacement_m", "m"),
    Channel("acceleration_m_s2", "acceleration_m_s2", "m/s^2"),
    Channel("current_command_a", "current_command_A", "A", held=True),
    Channel("fluid_temperature_c", "fluid_temperature_C", "degC"),
    Channel("body_velocity_m_s", "body_velocity_m_s", "m/s"),
)
BY_ATTRIBUTE = {channel.attribute: channel for channel in CHANNELS}
BY_COLUMN = {channel.column: channel for channel in CHANNELS}
KINEMATICS = ("displacement_m", "velocity_m_s", "acceleration_m_s2")


@dataclass(frozen=True, eq=False)
class Run:
    """One run in SI units and degC: float64 arrays of equal length, uniformly sampled.

    A run that was read without force or current (because the caller needs none) has NaN there, so that a use
    by mistake shows; ask `has_force`, `has_current`. `derived` names the channels that were not measured but
    computed from others; `notes` says how the file was read. `lines` holds each sample's line in the file
    (None where a file has none), `declared` the channels whose unit a person stated. Force and motion are
    moving means over `averaged_s` (0: they are not).
    """

    name: str
    file: Path
    time_s: FloatArray
    velocity_m_s: FloatArray
    current_a: FloatArray
    temperature_c: FloatArray
    force_n: FloatArray
    displacement_m: FloatArray
    acceleration_m_s2: FloatArray
    sample_rate_hz: float
    current_command_a: FloatArray | None = None
    fluid_temperature_c: FloatArray | None = None
    body_velocity_m_s: FloatArray | None = None
    derived: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    lines: IntArray | None = field(default=None, repr=False)
    declared: frozenset[str] = frozenset()
    averaged_s: float = 0.0

    def __post_init__(self) -> None:
        """Hold the arrays to float64 of one length; ValueError otherwise (a mistake of the program)."""
        count = len(self.time_s)
        for channel in CHANNELS:
            values = getattr(self, channel.attribute)
            if values is None:
                continue
            array = np.ascontiguousarray(values, dtype=np.float64)
            if array.shape != (count,):
                raise ValueError(
                    f"{channel.attribute} of {self.name}: shape {array.shape}, time has {count} samples"
                )
            object.__setattr__(self, channel.attribute, array)

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def dt_s(self) -> float:
        """The time between two samples, in s."""
        return 1.0 / self.sample_rate_hz

    @property
    def has_force(self) -> bool:
        """Whether force was measured."""
        return not bool(np.isnan(self.force_n).all())

    @property
    def has_current(self) -> bool:
        """Whether current was recorded."""
        return not bool(np.isnan(self.current_a).all())

    def row(self, index: int) -> int:
        """The line of sample `index` in the file; where a file has no lines, the sample's number from 1."""
        return int(self.lines[index]) if self.lines is not None else index + 1


@dataclass(frozen=True, eq=False)
class Campaign:
    """The runs of a folder or file, in stable order.

    `sha256` identifies the data: the hash of one line `<sha256 of the file>  <path below root>` per file, in
    order, as `sha256sum` would print them. `warnings` are for the caller to print.
    """

    root: Path
    runs: tuple[Run, ...]
    sha256: str
    warnings: tuple[Problem, ...] = ()

    def __len__(self) -> int:
        return len(self.runs)
