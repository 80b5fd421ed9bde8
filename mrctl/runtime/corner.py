"""One damper in the tick: its signals, its state, its current.

    INIT        not all signals have been good yet: no current
    ACTIVE      law and inverse model on good signals
    SUBSTITUTE  a signal is gone but can be stood in for: without body velocity a constant damping is the
                wish; without temperature its last value holds; without relative velocity the current holds
    LIMP        a signal is gone that nothing can stand in for: constant medium current
    OFF         shut down, or nobody on the bus: current ramped to 0 A

The state follows from what each signal is worth in this tick, so every state is left by itself once a run of
good frames has made the signals usable again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from mrctl.can.frames import State
from mrctl.control.base import ForceLaw, Motion
from mrctl.control.body_velocity import BodyVelocityEstimator
from mrctl.control.maps import CurrentMap
from mrctl.model.damper import Span
from mrctl.model.static import Reach
from mrctl.runtime.channel import Channel, Fault

# Skipped periods that the filters are stepped through; a longer gap is started afresh.
CATCH_UP_MAX = 50


@dataclass(frozen=True, slots=True)
class CornerPlan:
    """All that one damper's part of the tick is built from. Roles name the signals (see `Motion`)."""

    name: str
    law: ForceLaw
    substitute_law: ForceLaw
    make_map: Callable[[float], CurrentMap]  # from the step in s
    needs: frozenset[str]  # roles that ACTIVE stands on
    current_max_a: float
    slew_a_s: float
    limp_current_a: float
    off_ramp_s: float
    temperature_valid_c: Span
    velocity_cutoff_hz: float | None  # not None: body velocity is integrated from body acceleration


class Corner:
    """The controller of one damper, advanced once a tick."""

    __slots__ = (
        "_body",
        "_body_velocity_m_s",
        "_estimator",
        "_limp_a",
        "_map",
        "_needed",
        "_off_step",
        "_plan",
        "_running",
        "_slew_step",
        "cause",
        "channels",
        "clamped",
        "current_a",
        "made_in",
        "saturated",
        "state",
        "wish_n",
    )

    def __init__(self, plan: CornerPlan, channels: Mapping[str, Channel], dt_s: float) -> None:
        """channels: by role, at least those the plan needs."""
        self._plan = plan
        self.channels = dict(channels)
        self._needed = tuple((role, channels[role]) for role in sorted(plan.needs))
        self._map = plan.make_map(dt_s)
        self._estimator = (
            None if plan.velocity_cutoff_hz is None else BodyVelocityEstimator(plan.velocity_cutoff_hz, dt_s)
        )
        self._body = self.channels.get("body_velocity")
        self._body_velocity_m_s = 0.0
        self._slew_step = plan.slew_a_s * dt_s
        self._off_step = min(self._slew_step, plan.current_max_a * dt_s / plan.off_ramp_s)
        self._limp_a = plan.limp_current_a
        self._running = False  # whether the current map followed the wish in the last tick
        self.state = State.INIT
        self.cause = ("START_UP", Fault.NONE)  # a role and its fault, or another cause
        self.current_a = 0.0
        self.wish_n = 0.0
        self.made_in = -1
        self.clamped = False
        self.saturated = False

    def step(self, now: int, periods: int, *, starting: bool, off: str | None) -> float:
        """The current wanted in tick `now`, in A.

        periods: loop periods since the last tick (1 unless ticks were skipped). starting: still within the
        time that signals have to appear. off: why the damper shall be off, or None.
        """
        self._judge(now, starting=starting, off=off)
        if self._estimator is not None:
            acceleration = self.channels["body_acceleration"].value
            for _ in range(min(periods, CATCH_UP_MAX)):
                self._body_velocity_m_s = self._estimator.step(acceleration)
        elif self._body is not None:
            self._body_velocity_m_s = self._body.value
        state = self.state
        self.made_in = now
        velocity = self.channels["relative_velocity"]
        if state is State.ACTIVE or (state is State.SUBSTITUTE and velocity.ok):
            self._follow(state, periods)
        else:
            self._running = False
            self.saturated = False
            if state is State.LIMP:
                self._approach(self._limp_a, self._slew_step)
            elif state is not State.SUBSTITUTE:  # INIT, OFF; SUBSTITUTE without velocity holds the current
                self._approach(0.0, self._off_step)
        return self.current_a

    def issued(self, current_a: float) -> None:
        """What the output guard let through: the next step starts from there."""
        self.current_a = current_a
        self._map.current_a = current_a

    def _judge(self, now: int, *, starting: bool, off: str | None) -> None:
        """State and cause from what the signals are worth now."""
        state, cause = State.ACTIVE, ("NONE", Fault.NONE)
        for role, channel in self._needed:
            if channel.update(now):
                continue
            worth = State.SUBSTITUTE if channel.substitutable(now) else State.LIMP
            if worth > state:
                state, cause = worth, (role, channel.fault)
        if off is not None:
            self.state, self.cause = State.OFF, (off, Fault.NONE)
        elif starting and self.state is State.INIT and state is not State.ACTIVE:
            self.cause = ("START_UP", Fault.NONE)
        else:
            self.state, self.cause = state, cause

    def _follow(self, state: State, periods: int) -> None:
        """Law and current map on the signals as they are."""
        channels = self.channels
        velocity = channels["relative_velocity"].value
        temperature = channels["temperature"].value
        wish_of = self._plan.law
        if state is State.SUBSTITUTE and any(
            role != "temperature" and not channel.ok for role, channel in self._needed
        ):
            wish_of = self._plan.substitute_law
        displacement, force_wish = channels.get("displacement"), channels.get("force_wish")
        wish = wish_of(
            Motion(
                velocity,
                self._body_velocity_m_s,
                temperature,
                0.0 if displacement is None else displacement.value,
                0.0 if force_wish is None else force_wish.value,
            )
        )
        last = self.current_a
        if not self._running or periods > CATCH_UP_MAX:
            self._map.reset(wish, last)
            self._running = True
            periods = 1
        for _ in range(periods):  # skipped periods too, so that the filters stay in step with time
            wanted = self._map.step(wish, velocity, temperature)
        self.current_a = last
        self._approach(wanted, self._slew_step)
        self.wish_n = wish
        self.saturated = self._map.reach is not Reach.WITHIN
        self.clamped = not self._plan.temperature_valid_c.contains(temperature)

    def _approach(self, target_a: float, step_a: float) -> None:
        change = target_a - self.current_a
        self.current_a += step_a if change > step_a else max(change, -step_a)
