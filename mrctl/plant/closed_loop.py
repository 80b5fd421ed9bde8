"""One corner and one controller in lock step, off line: what the controller makes of a road."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.control.base import ForceLaw, Motion
from mrctl.control.maps import CurrentMap
from mrctl.model.damper import Damper
from mrctl.plant.corner import STEP_S, Corner
from mrctl.plant.quarter_car import QuarterCar
from mrctl.plant.virtual_damper import Extremes, PhysicsParameters, VirtualDamper

Array = NDArray[np.float64]

# From the motion of a corner to (wished force in N, current command in A).
Controller = Callable[[Motion], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Record:
    """A run: arrays of one value a control tick, all of the same length."""

    time_s: Array
    relative_velocity_m_s: Array
    body_velocity_m_s: Array
    body_acceleration_m_s2: Array
    displacement_m: Array
    force_wish_n: Array
    force_n: Array
    force_soft_n: Array  # what the true damper's force would be, had the current always been 0
    force_firm_n: Array  # the same for the largest current
    current_command_a: Array
    current_a: Array
    temperature_c: Array
    tyre_force_n: Array

    def after(self, start_s: float) -> Record:
        """The part of the run from start_s on."""
        keep = self.time_s >= start_s
        return Record(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))


@dataclass(frozen=True, slots=True)
class Metrics:
    """How well a run went. Percentages are of the largest absolute force of the run."""

    peak_force_n: float
    tracking_rms_n: float  # force against the wish as far as the true damper can follow it
    tracking_percent: float
    raw_tracking_rms_n: float  # force against the wish itself
    raw_tracking_percent: float
    body_acceleration_rms_m_s2: float
    tyre_load_variation_rms_n: float


def controller(law: ForceLaw, current_map: CurrentMap) -> Controller:
    """A law and a current map as one controller."""

    def step(motion: Motion) -> tuple[float, float]:
        wish = law(motion)
        return wish, current_map.step(wish, motion.relative_velocity_m_s, motion.temperature_c)

    return step


def constant_current(law: ForceLaw, current_a: float) -> Controller:
    """A damper left at one current, against what a law would have wished: passive soft or firm."""

    def step(motion: Motion) -> tuple[float, float]:
        return law(motion), current_a

    return step


def measured_corner(
    car: QuarterCar, damper: Damper, temperature_c: float, physics: PhysicsParameters | None = None
) -> Corner:
    """A corner that also records what its damper could have done; as warm as its surroundings."""
    return Corner(
        car,
        VirtualDamper(damper, STEP_S, temperature_c, physics),
        STEP_S,
        Extremes(damper, STEP_S),
    )


def simulate(corner: Corner, control: Controller, duration_s: float, control_dt_s: float = 0.001) -> Record:
    """Run the corner for duration_s with the controller called every control_dt_s; perfect sensors.

    At each tick: the controller sees the corner as it is, then the corner advances with its current.
    The forces recorded at a tick belong to the velocity recorded there. Raises ValueError for a corner
    without extremes.
    """
    if corner.extremes is None:
        raise ValueError("this corner has no extremes to measure tracking against; use measured_corner")
    count = round(duration_s / control_dt_s)
    rows = []
    for tick in range(count):
        before = corner.state()
        wish, current_a = control(
            Motion(
                before.relative_velocity_m_s,
                before.body_velocity_m_s,
                before.temperature_c,
                before.displacement_m,
            )
        )
        soft, firm = corner.extremes.soft_n, corner.extremes.firm_n
        corner.step(control_dt_s, current_a)
        rows.append(
            (
                tick * control_dt_s,
                before.relative_velocity_m_s,
                before.body_velocity_m_s,
                before.body_acceleration_m_s2,
                before.displacement_m,
                wish,
                before.force_n,
                soft,
                firm,
                current_a,
                before.current_a,
                before.temperature_c,
                before.tyre_force_n,
            )
        )
    return Record(*np.array(rows, dtype=np.float64).reshape(count, -1).T)


def reachable(record: Record) -> Array:
    """The wish in N as far as the true damper can follow: brought between its extremes."""
    low = np.minimum(record.force_soft_n, record.force_firm_n)
    high = np.maximum(record.force_soft_n, record.force_firm_n)
    return np.clip(record.force_wish_n, low, high)


def metrics(record: Record) -> Metrics:
    """Force tracking, comfort and road holding of a run."""
    peak = float(np.max(np.abs(record.force_n), initial=0.0))
    tracking = _rms(record.force_n - reachable(record))
    raw = _rms(record.force_n - record.force_wish_n)
    percent = 100.0 / peak if peak > 0.0 else float("nan")
    return Metrics(
        peak_force_n=peak,
        tracking_rms_n=tracking,
        tracking_percent=percent * tracking,
        raw_tracking_rms_n=raw,
        raw_tracking_percent=percent * raw,
        body_acceleration_rms_m_s2=_rms(record.body_acceleration_m_s2),
        tyre_load_variation_rms_n=_rms(record.tyre_force_n - np.mean(record.tyre_force_n)),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
