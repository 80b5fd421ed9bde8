"""The names that a DBC must use: frames, signals, states, causes. Layouts, IDs and scales are its own."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum

# frame name -> prefix of its signals; the damper's name follows: RelVel_FL.
SENSOR_FRAMES = {
    "RelativeVelocity": "RelVel",
    "BodyVelocity": "BodyVel",
    "BodyAcceleration": "BodyAcc",
    "CaseTemperature": "CaseTemp",
    "Displacement": "Disp",
    "MeasuredForce": "Force",
    "ForceWish": "ForceWish",
}
COMMAND_FRAMES = {"CurrentCommand": "Cur"}
STATE_SIGNALS = ("State", "Cause", "Clamped", "Saturated", "Guarded")
HEALTH_SIGNALS = ("LatenessP50", "LatenessP99", "LatenessMax", "Overruns", "Rejected", "Uptime")
TIMING_SIGNALS = ("LatenessP999", "DurationP50", "DurationP99", "DurationMax", "LongTicks")
REJECT_SIGNALS = (
    "RejectedCRC",
    "RejectedCounter",
    "RejectedRange",
    "RejectedRate",
    "RejectedNotAvail",
    "RejectedLength",
    "RejectedKind",
    "Dropped",
)
OPTIONAL_FRAMES_OUT = ("HealthTiming", "HealthRejects")
"""Sent where the DBC has them."""
FRAMES_OUT = ("CurrentCommand", "ControllerState", "Health", *OPTIONAL_FRAMES_OUT)


class State(IntEnum):
    """What the controller does with a damper; the numbers of `State_*` in the DBC."""

    INIT = 0
    ACTIVE = 1
    SUBSTITUTE = 2
    LIMP = 3
    OFF = 4


# Why a damper is not ACTIVE; the numbers of `Cause_*` in the DBC: 1 + 7 * source + fault for an input.
CAUSE_SOURCES = ("RELATIVE_VELOCITY", "BODY_MOTION", "CASE_TEMPERATURE", "FORCE_WISH")
CAUSE_FAULTS = ("MISSING", "NOT_AVAILABLE", "CRC", "COUNTER", "RANGE", "RATE", "MALFORMED")
CAUSES = (
    "NONE",
    *(f"{source}_{fault}" for source in CAUSE_SOURCES for fault in CAUSE_FAULTS),
    "OUTPUT_GUARD",
    "SHUTDOWN",
    "START_UP",
)
CAUSE_CODE = {name: code for code, name in enumerate(CAUSES)}


def signals_of(frame: str, dampers: Iterable[str]) -> tuple[str, ...]:
    """The signals of a frame that the dampers need, in the order in which codecs then take and give them.

    Sensor and command frames: one per damper. ControllerState: State, Cause, Clamped, Saturated, Guarded,
    each for all dampers. Health, HealthTiming, HealthRejects: their signals. Raises KeyError
    for a frame that mrctl does not know.
    """
    names = tuple(dampers)
    figures = {"Health": HEALTH_SIGNALS, "HealthTiming": TIMING_SIGNALS, "HealthRejects": REJECT_SIGNALS}
    if frame in figures:
        return figures[frame]
    if frame == "ControllerState":
        return tuple(f"{signal}_{name}" for signal in STATE_SIGNALS for name in names)
    prefix = {**SENSOR_FRAMES, **COMMAND_FRAMES}[frame]
    return tuple(f"{prefix}_{name}" for name in names)
