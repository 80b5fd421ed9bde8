"""One corner of the vehicle: a quarter car on a virtual damper."""

from __future__ import annotations

from typing import NamedTuple

from mrctl.plant.quarter_car import QuarterCar
from mrctl.plant.virtual_damper import Extremes, VirtualDamper

STEP_S = 0.0005  # 2 kHz, the sample rate of the damper's filters


class CornerState(NamedTuple):
    """What is true of a corner at one moment."""

    relative_velocity_m_s: float
    body_velocity_m_s: float
    body_acceleration_m_s2: float
    displacement_m: float
    force_n: float
    current_a: float
    temperature_c: float
    tyre_force_n: float


class Corner:
    """A quarter car and its damper, advanced together."""

    def __init__(
        self,
        car: QuarterCar,
        damper: VirtualDamper,
        step_s: float = STEP_S,
        extremes: Extremes | None = None,
    ) -> None:
        """step_s must be the step of the damper and of the extremes, if these are wanted along with it."""
        self.car = car
        self.damper = damper
        self.extremes = extremes
        self._step_s = step_s

    def step(self, dt_s: float, current_command_a: float) -> None:
        """Advance by dt_s, a whole number of integration steps, with this current commanded.

        Raises ValueError when dt_s is not a whole number of steps.
        """
        count = round(dt_s / self._step_s)
        if count < 1 or abs(count * self._step_s - dt_s) > 1e-6 * self._step_s:
            raise ValueError(f"{dt_s!r} s is no whole number of {self._step_s!r} s steps; choose a multiple")
        car, damper, extremes, step_s = self.car, self.damper, self.extremes, self._step_s
        for _ in range(count):
            car.step(step_s, damper.force_n)
            velocity = car.body_velocity_m_s - car.wheel_velocity_m_s
            if extremes is not None:
                extremes.step(velocity, damper.temperature_c)
            damper.step(velocity, current_command_a)

    def state(self) -> CornerState:
        """What is true now."""
        car, damper = self.car, self.damper
        return CornerState(
            car.relative_velocity_m_s,
            car.body_velocity_m_s,
            car.body_acceleration_m_s2,
            car.displacement_m,
            damper.force_n,
            damper.current_a,
            damper.temperature_c,
            car.tyre_force_n,
        )
