"""One damper in the tick: its signals, its state, its current.

    INIT        not all signals have been good yet, since the start or since the bus fell silent: no current
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
from typing import Final, Protocol

from mrctl.can.frames import State
from mrctl.control.anticipation import Anticipation
from mrctl.control.base import ForceLaw, Motion
from mrctl.control.body_velocity import BodyVelocityEstimator
from mrctl.control.maps import CurrentMap
from mrctl.model.damper import Span
from mrctl.model.inverse import InverseModel
from mrctl.model.pipeline import InversePipeline
from mrctl.model.static_inverse import WITHIN
from mrctl.runtime.channel import NEVER, Channel, Fault

INIT: Final = State.INIT
ACTIVE: Final = State.ACTIVE
SUBSTITUTE: Final = State.SUBSTITUTE
LIMP: Final = State.LIMP
OFF: Final = State.OFF
_BEFORE_ACTIVE: Final = frozenset({INIT, OFF})
START_UP: Final = ("START_UP", Fault.NONE)
WELL: Final = ("NONE", Fault.NONE)

# Skipped periods that the filters are stepped through; a longer gap is started afresh.
CATCH_UP_MAX: Final = 50


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
    anticipation_s: float  # the current is worked out for the motion so far ahead
    velocity_cutoff_hz: float | None  # not None: body velocity is integrated from body acceleration


class _Value(Protocol):
    """Something with a value: a channel, or a stand-in for what the car does not measure."""

    value: float


@dataclass(slots=True)
class _Held:
    value: float = 0.0


class Corner:
    """The controller of one damper, advanced once a tick."""

    __slots__ = (
        "_acceleration",
        "_all_needed",
        "_asked_by_law",
        "_body",
        "_body_ahead",
        "_coldest_c",
        "_command",
        "_displacement",
        "_estimator",
        "_fresh_until",
        "_hottest_c",
        "_inverse",
        "_law",
        "_limp_a",
        "_look_ahead",
        "_map",
        "_motion",
        "_needed",
        "_off_step",
        "_running",
        "_slew_step",
        "_substitute_law",
        "_temperature",
        "_velocity",
        "_velocity_ahead",
        "_wants_more",
        "_wish",
        "cause",
        "channels",
        "clamped",
        "current_a",
        "made_in",
        "name",
        "saturated",
        "state",
        "wish_n",
    )

    def __init__(self, plan: CornerPlan, channels: Mapping[str, Channel], dt_s: float) -> None:
        """channels: by role, at least those the plan needs."""
        self.name = plan.name
        self.channels = dict(channels)
        self._needed = tuple((role, channels[role]) for role in sorted(plan.needs))
        self._all_needed = tuple(channel for _, channel in self._needed)
        self._fresh_until = NEVER  # up to this tick all that is needed is fresh, whatever comes
        self._asked_by_law = tuple(c for role, c in self._needed if role != "temperature")
        self._velocity = channels["relative_velocity"]
        self._temperature = channels["temperature"]
        self._body: _Value = channels.get("body_velocity") or _Held()
        self._displacement: _Value = channels.get("displacement") or _Held()
        self._wish: _Value = channels.get("force_wish") or _Held()
        self._wants_more = bool({"displacement", "force_wish"} & set(channels))
        self._estimator = None
        if plan.velocity_cutoff_hz is not None:
            self._estimator = BodyVelocityEstimator(plan.velocity_cutoff_hz, dt_s)
            self._acceleration = channels["body_acceleration"]
            self._body = _Held()
        self._look_ahead = plan.anticipation_s > 0.0
        self._velocity_ahead = Anticipation(plan.anticipation_s, dt_s)
        self._body_ahead = Anticipation(plan.anticipation_s, dt_s)
        self._motion = Motion(0.0, 0.0, 0.0)
        self._law, self._substitute_law = plan.law, plan.substitute_law
        self._slew_step = plan.slew_a_s * dt_s
        self._off_step = min(self._slew_step, plan.current_max_a * dt_s / plan.off_ramp_s)
        self._limp_a = plan.limp_current_a
        self.state = INIT
        self.cause = START_UP  # a role and its fault, or another cause
        self.current_a = 0.0
        self.recalibrate(plan.make_map(dt_s), plan.temperature_valid_c)
        self.wish_n = 0.0
        self.made_in = -1
        self.clamped = False
        self.saturated = False

    def recalibrate(self, current_map: CurrentMap, temperature_valid_c: Span) -> None:
        """Command through another current map from the next tick on; the current goes on from where it is."""
        self._map = current_map
        # The map of nearly all: called straight, where this is compiled.
        self._inverse = current_map if type(current_map) is InverseModel else None
        self._command: Callable[[float, float, float], float] = current_map.step
        if isinstance(current_map, InversePipeline):  # a damper with effects, some of which want its stroke
            stroke, with_stroke = self._displacement, current_map.step
            self._command = lambda wish, v, temperature: with_stroke(wish, v, temperature, stroke.value)
        self._coldest_c, self._hottest_c = temperature_valid_c.low, temperature_valid_c.high
        self._running = False  # whether the current map followed the wish in the last tick

    def step(self, now: int, periods: int, starting: bool, off: str | None) -> float:  # noqa: FBT001  # hot
        """The current wanted in tick `now`, in A.

        periods: loop periods since the last tick (1 unless ticks were skipped). starting: still within the
        time that signals have to appear. off: why the damper shall be off, or None.
        """
        if off is None and (now <= self._fresh_until or self._all_fresh(now)):  # nearly always
            if self.state is not ACTIVE:
                self.state, self.cause = ACTIVE, WELL
        else:
            self._judge(now, starting, off)
        if self._estimator is not None:
            for _ in range(min(periods, CATCH_UP_MAX)):
                self._body.value = self._estimator.step(self._acceleration.value)
        self.made_in = now
        state = self.state
        current_a, slew_step = self.current_a, self._slew_step
        if state is ACTIVE or (state is SUBSTITUTE and self._velocity.ok):
            target_a = self._follow(state, periods)
        else:
            self._running = False
            self.saturated = False
            if state is LIMP:
                target_a = self._limp_a
            elif state is SUBSTITUTE:  # without velocity: the current holds
                target_a = current_a
            else:
                target_a, slew_step = 0.0, self._off_step
        change = target_a - current_a
        if change > slew_step:
            change = slew_step
        elif change < -slew_step:
            change = -slew_step
        self.current_a = current_a = current_a + change
        return current_a

    def _all_fresh(self, now: int) -> bool:
        """Whether all that is needed is; and until when it will be: no `until` comes nearer than it was."""
        fresh_until = self._velocity.until
        for channel in self._all_needed:
            if channel.until < fresh_until:  # noqa: PLR1730  # min() takes three times as long, hot
                fresh_until = channel.until
        self._fresh_until = fresh_until
        return now <= fresh_until

    def issued(self, current_a: float) -> None:
        """What the output guard let through: the next step starts from there."""
        self.current_a = current_a
        self._map.current_a = current_a

    def _judge(self, now: int, starting: bool, off: str | None) -> None:  # noqa: FBT001  # hot
        """State and cause from what the signals are worth now."""
        state, cause = ACTIVE, WELL
        for role, channel in self._needed:
            if now <= channel.until or channel.update(now):
                continue
            worth = SUBSTITUTE if channel.substitutable(now) else LIMP
            if worth > state:
                state, cause = worth, (role, channel.fault)
        if off is not None:
            state, cause = OFF, (off, Fault.NONE)
        elif starting and state is not ACTIVE and self.state in _BEFORE_ACTIVE:
            state, cause = INIT, START_UP
        self.state, self.cause = state, cause

    def _follow(self, state: State, periods: int) -> float:
        """The current in A that law and current map make of the signals as they are."""
        motion, law = self._motion, self._law
        velocity, body = self._velocity.value, self._body.value
        if self._look_ahead:
            velocity, body = self._velocity_ahead.step(velocity), self._body_ahead.step(body)
        motion.relative_velocity_m_s = velocity
        motion.body_velocity_m_s = body
        motion.temperature_c = temperature = self._temperature.value
        if self._wants_more:
            motion.displacement_m = self._displacement.value
            motion.force_wish_n = self._wish.value
        if state is not ACTIVE and any(not channel.ok for channel in self._asked_by_law):
            law = self._substitute_law
        wish = law(motion)
        if periods > 1 or not self._running:
            self._catch_up(wish, velocity, temperature, periods)
        inverse = self._inverse
        if inverse is not None:  # nearly always
            wanted = inverse.step(wish, velocity, temperature)
            reach = inverse.reach
        else:
            wanted = self._command(wish, velocity, temperature)
            reach = self._map.reach
        self.wish_n = wish
        self.saturated = reach is not WITHIN
        self.clamped = not self._coldest_c <= temperature <= self._hottest_c
        return wanted

    def _catch_up(self, wish: float, velocity: float, temperature: float, periods: int) -> None:
        """Step the map through skipped periods, so that its filters stay in step with time; or start it."""
        if not self._running or periods > CATCH_UP_MAX:
            self._map.reset(wish, self.current_a)
            self._running = True
        else:
            for _ in range(periods - 1):
                self._command(wish, velocity, temperature)
