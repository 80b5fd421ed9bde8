"""A configuration in memory: paths resolved, calibrations loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from mrctl.calibration import Calibration
from mrctl.can.busload import BusLoad
from mrctl.config.models import (
    BodyVelocityConfig,
    BusConfig,
    ControlConfig,
    LogConfig,
    LoopConfig,
    PlantConfig,
    RealtimeConfig,
    SafetyConfig,
)
from mrctl.config.signal_rules import SignalRules
from mrctl.errors import Problem


@dataclass(frozen=True, slots=True)
class DamperConfig:
    """One damper: the names of its signals by role, of its command, and its calibration file."""

    signals: Mapping[str, str]
    command: str
    calibration: Path


@dataclass(frozen=True, slots=True)
class FramesConfig:
    """How often each frame comes and goes, Hz."""

    receive: Mapping[str, float]
    send: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Config:
    """One controller on one bus. `signals` holds the rules by role, `calibrations` one for each damper."""

    path: Path
    sha256: str
    bus: BusConfig
    database: Path
    loop: LoopConfig
    dampers: Mapping[str, DamperConfig]
    calibrations: Mapping[str, Calibration]
    control: ControlConfig
    body_velocity_from_acceleration: BodyVelocityConfig
    signals: Mapping[str, SignalRules]
    safety: SafetyConfig
    frames: FramesConfig
    realtime: RealtimeConfig
    log: LogConfig
    plant: PlantConfig
    bus_load: BusLoad  # at worst, with the rates in `frames`
    warnings: tuple[Problem, ...] = ()

    def on_bus(self, channel: str | None = None, interface: str | None = None) -> Config:
        """The same configuration on another CAN channel or interface; None leaves what it says."""
        update = {"channel": channel, "interface": interface}
        given = {name: value for name, value in update.items() if value is not None}
        return replace(self, bus=self.bus.model_copy(update=given))
