"""The configuration file's shape (`mrctl/config/1`): bus, dampers, control, safety, rates."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from mrctl.config.signal_rules import SignalRulesFile
from mrctl.yaml_source import StrictModel

SCHEMA = "mrctl/config/1"
VERSION = 1

Rate = Annotated[float, Field(gt=0.0, le=10_000.0)]
Word = Annotated[str, Field(min_length=1, max_length=200)]
DamperName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=32)]
# Judged by the law or map that they belong to: numbers, or lists of them.
Parameters = dict[str, Any]


class BusConfig(StrictModel):
    """The CAN bus, as python-can names it."""

    interface: Word = Field(default="socketcan", description="python-can interface: socketcan, virtual, …")
    channel: Word = Field(default="vcan0", description="the interface's name, e.g. can0")
    bitrate: int = Field(default=500_000, ge=10_000, le=1_000_000, description="bit/s of the arbitration")
    fd: bool = Field(default=False, description="CAN FD frames with a faster data phase")
    data_bitrate: int | None = Field(default=None, ge=10_000, le=10_000_000, description="bit/s, FD only")
    load_limit: float = Field(default=0.6, gt=0.0, le=1.0, description="largest worst-case load of the bus")


class LoopConfig(StrictModel):
    """The control loop."""

    rate_hz: float = Field(default=500.0, ge=50.0, le=5000.0, description="ticks a second")


class DamperSignals(StrictModel):
    """Names of a damper's signals in the DBC."""

    relative_velocity: Word = Field(description="damper velocity, m/s, > 0 is extension")
    temperature: Word = Field(description="temperature of the damper's case, degC")
    body_velocity: Word | None = Field(default=None, description="vertical, m/s, > 0 is upward")
    body_acceleration: Word | None = Field(
        default=None, description="vertical, m/s2, instead of the velocity"
    )
    displacement: Word | None = Field(default=None, description="damper stroke, m, > 0 is extension")
    force: Word | None = Field(default=None, description="measured damper force, N")
    force_wish: Word | None = Field(default=None, description="desired damper force, N, for the law external")


class DamperEntry(StrictModel):
    """One damper on the bus."""

    signals: DamperSignals = Field(description="names of its signals in the DBC")
    command: Word = Field(description="name of its current command in the DBC")
    calibration: Word | None = Field(default=None, description="its own calibration, if it differs")


class ControlConfig(StrictModel):
    """From motion to desired force, and from force to current."""

    law: Word = Field(default="skyhook_continuous", description="control law")
    parameters: Parameters = Field(default={}, description="the law's parameters")
    current_map: Word = Field(default="inverse", description="from desired force to current")
    map_parameters: Parameters = Field(default={}, description="the map's parameters")
    anticipation_ms: float = Field(
        default=0.0,
        ge=0.0,
        le=50.0,
        description="the current is worked out for the motion so far ahead; about the coil's time constant",
    )


class BodyVelocityConfig(StrictModel):
    """Integration of the body's acceleration, where a car has no body velocity."""

    cutoff_hz: float = Field(default=0.2, gt=0.0, description="drift below this frequency is removed")


class SafetyConfig(StrictModel):
    """What happens when signals are bad, and at start and end."""

    limp_current_a: float = Field(default=1.0, ge=0.0, description="constant current in LIMP, A")
    off_ramp_s: float = Field(default=0.2, gt=0.0, le=10.0, description="from the largest current to 0 A")
    init_timeout_s: float = Field(default=2.0, ge=0.0, description="time that signals have to appear")
    bus_silent_off_s: float = Field(default=5.0, gt=0.0, description="no valid frame at all for so long: OFF")
    reentry_good_frames: int = Field(
        default=10, ge=1, le=10_000, description="good frames before a signal is used"
    )
    substitute_damping_n_s_m: float = Field(
        default=1500.0, ge=0.0, description="damping wished for while the law lacks a signal"
    )
    nominal_temperature_c: float = Field(default=40.0, ge=-100.0, le=300.0, description="before one is known")


class FramesEntry(StrictModel):
    """Frames on the bus and how often they come, per second."""

    receive: dict[str, Rate] | None = Field(default=None, description="frame: Hz; as in the DBC if left out")
    send: dict[str, Rate] = Field(default={}, description="frame: Hz")


class RealtimeConfig(StrictModel):
    """What the daemon asks of the system; what is refused is said in the log, and it runs all the same."""

    priority: int | None = Field(
        default=None, ge=1, le=99, description="SCHED_FIFO priority; null leaves what it was started with"
    )
    cpus: Annotated[list[Annotated[int, Field(ge=0, le=4095)]], Field(min_length=1)] | None = Field(
        default=None, description="processors to run on; null leaves what it was started with"
    )
    cpu_awake: bool = Field(
        default=True,
        description="no processor sleeps deeper than it wakes from at once (/dev/cpu_dma_latency)",
    )
    poll_us: float = Field(
        default=60.0,
        ge=0.0,
        description="polls the clock for so long before each tick, as sleep ends late: costs rate_hz * "
        "poll_us of a processor, 3 % at 500 Hz; 0 only sleeps",
    )
    lock_memory: bool = Field(default=True, description="no page of its memory goes to disk")
    freeze_gc: bool = Field(default=True, description="no garbage collection while it runs")


class LogConfig(StrictModel):
    """What the log says."""

    level: Literal["debug", "info", "warning", "error"] = "info"


class PlantConfig(StrictModel):
    """The simulated vehicle of `mrctl plant`."""

    temperature_c: float = Field(default=25.0, ge=-60.0, le=200.0, description="of the dampers at start")
    road_class: Literal["A", "B", "C", "D", "E"] = Field(default="C", description="ISO 8608")
    speed_m_s: float = Field(default=20.0, gt=0.0, le=100.0)
    seed: int = Field(default=1, ge=0, description="of the random road")
    bump_height_m: float = Field(default=0.05, ge=0.0, le=0.5, description="a bump in the road; 0: none")
    coil_lag_s: float = Field(default=0.008, ge=0.0, le=1.0, description="time constant of the coil current")


class ConfigFile(StrictModel):
    """A configuration: one controller on one bus."""

    schema_: Literal["mrctl/config/1"] = Field(alias="schema", description="kind and version of this file")
    bus: BusConfig = BusConfig()
    database: Word | None = Field(default=None, description="DBC file, relative to this file")
    loop: LoopConfig = LoopConfig()
    calibration: Word = Field(default="calibration.yaml", description="calibration of the dampers, relative")
    dampers: Annotated[dict[DamperName, DamperEntry], Field(min_length=1, max_length=16)] = Field(
        description="the dampers by name"
    )
    control: ControlConfig = ControlConfig()
    body_velocity_from_acceleration: BodyVelocityConfig = BodyVelocityConfig()
    signals: SignalRulesFile = SignalRulesFile()
    safety: SafetyConfig = SafetyConfig()
    frames: FramesEntry = FramesEntry()
    realtime: RealtimeConfig = RealtimeConfig()
    log: LogConfig = LogConfig()
    plant: PlantConfig = PlantConfig()
