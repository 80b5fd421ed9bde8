"""The forward and inverse model of a damper with effects, sample by sample, in plain floats.

The order of computation and what the symbols mean stand in `mrctl.model.effects.base`. Without effects
both are the forward and the inverse model, to the last bit.

The inverse goes through the stages backwards. What depends on the current that it is looking for (the
fluid's temperature, the piston's motion, the field) is followed with the commands already sent; one
sample's delay is the price.
"""

from __future__ import annotations

from mrctl.model.damper import Damper
from mrctl.model.effects.base import Settings
from mrctl.model.effects.registry import of_damper
from mrctl.model.filters import iir_step, plain_lag, settled_state
from mrctl.model.inverse import InverseModel
from mrctl.model.running import Acceleration, Stages
from mrctl.model.static import force_level
from mrctl.model.tables import interpolate

# Factors that depend on the current are divided by again and again until they agree with it.
FACTOR_ROUNDS = 8
FACTOR_TOLERANCE = 1e-4


class ForwardPipeline:
    """One damper's force with its effects, sample by sample, at a fixed step."""

    __slots__ = ("_acceleration", "_coefficients", "_dt_s", "_lag", "_stages", "_state", "_static", "needs")

    def __init__(self, damper: Damper, dt_s: float, settings: Settings | None = None) -> None:
        """The damper's own effects, or those in `settings` by stage, in order.

        Raises FilterError when the filter cannot be carried to 1/dt_s, EffectError for unsound effects.
        """
        chosen = of_damper(damper) if settings is None else settings
        self._static = damper.static
        self._dt_s = dt_s
        self._coefficients = damper.forward_filter.resampled(1.0 / dt_s).coefficients
        self._lag = plain_lag(self._coefficients)
        self._stages = Stages(chosen)
        self.needs = needs(chosen)
        self.reset()

    def reset(self) -> None:
        """Forget all that was: H is at rest, and the effects begin with the next sample."""
        self._state = [0.0, 0.0, 0.0]
        self._acceleration = Acceleration(self._dt_s)
        self._stages.restart()

    def settle(
        self,
        velocity_m_s: float,
        current_a: float,
        temperature_c: float,
        displacement_m: float = 0.0,
        acceleration_m_s2: float = 0.0,
    ) -> None:
        """Take the state that this motion, held for ever, would lead to."""
        self.reset()
        back = self._backbone(velocity_m_s, current_a, temperature_c, displacement_m, acceleration_m_s2)[0]
        self.reset()
        self._state = settled_state(self._coefficients, back)

    def step(
        self,
        velocity_m_s: float,
        current_a: float,
        temperature_c: float,
        displacement_m: float = 0.0,
        acceleration_m_s2: float | None = None,
    ) -> float:
        """The damper's force in N at this sample, as a sensor reports it."""
        stages, dt = self._stages, self._dt_s
        a = self._acceleration.next(velocity_m_s, acceleration_m_s2)
        back, v, x, i, warm, level = self._backbone(velocity_m_s, current_a, temperature_c, displacement_m, a)
        force = iir_step(self._coefficients, self._state, back)
        for one in stages.additive:
            force += one.next(v, x, a, i, warm, dt)
        for one in stages.limit:
            force = one.next(force, v, x, warm, back, level, self._static, dt)
        for one in stages.rod:
            force += one.next(v, x, a, i, warm, dt)
        for one in stages.output:
            force = one.next(force, dt)
        return force

    def _backbone(
        self, v: float, i: float, temperature_c: float, x: float, a: float
    ) -> tuple[float, float, float, float, float, float]:
        """The static force; the piston's velocity and displacement, field current, temperature; and f h."""
        stages, t, dt = self._stages, self._static, self._dt_s
        for one in stages.current:
            i = one.next(i, dt)
        warm, v, x = stages.fluid_and_piston(v, x, a, i, temperature_c, t, self._lag, dt)
        level = force_level(i, warm, t)
        back = level * interpolate(v, t.velocity_m_s, t.shape)
        for one in stages.factor:
            back *= one.next(v, x, i, warm, dt)
        for one in stages.yielding:
            back = one.next(back, v, x, level, dt)
        return back, v, x, i, warm, level


class InversePipeline(InverseModel):
    """One damper's current command with its effects undone, sample by sample, at a fixed step."""

    __slots__ = (
        "_acceleration",
        "_dt_s",
        "_field_a",
        "_lag",
        "_largest_a",
        "_stages",
        "_tables",
        "needs",
    )

    def __init__(self, damper: Damper, dt_s: float, settings: Settings | None = None) -> None:
        """The damper's own effects, or those in `settings` by stage, in order.

        Raises FilterError when a filter cannot be carried to 1/dt_s, EffectError for unsound effects.
        """
        chosen = of_damper(damper) if settings is None else settings
        self._dt_s = dt_s
        self._tables = damper.static
        self._largest_a = damper.current_max_a
        self._stages = Stages(chosen)
        self._lag = plain_lag(damper.forward_filter.resampled(1.0 / dt_s).coefficients)
        self.needs = needs(chosen)
        super().__init__(damper, dt_s)

    def reset(self, force_wish_n: float = 0.0, current_a: float = 0.0) -> None:
        """Take the state that a constant wish leads to, with this current flowing; effects begin anew."""
        super().reset(force_wish_n, current_a)
        self._stages.restart()
        self._acceleration = Acceleration(self._dt_s)
        self._field_a = current_a

    def step(
        self,
        force_wish_n: float,
        velocity_m_s: float,
        temperature_c: float,
        displacement_m: float = 0.0,
        acceleration_m_s2: float | None = None,
    ) -> float:
        """The current command in A: finite, within 0 and the largest, within the slew limit of the last."""
        stages, t, dt = self._stages, self._tables, self._dt_s
        if not stages.everything:
            return super().step(force_wish_n, velocity_m_s, temperature_c)
        a = self._acceleration.next(velocity_m_s, acceleration_m_s2)
        field = self._field_a
        warm, v, x = stages.fluid_and_piston(
            velocity_m_s, displacement_m, a, field, temperature_c, t, self._lag, dt
        )
        wish = force_wish_n
        level, g = force_level(field, warm, t), interpolate(v, t.velocity_m_s, t.shape)
        for one in reversed(stages.output):
            wish = one.input_for(wish, wish, dt)
        for one in stages.rod:
            wish -= one.next(v, x, a, field, warm, dt)
        for one in reversed(stages.limit):
            wish = one.input_for(wish, wish, v, x, warm, level * g, level, t, dt)
        for one in stages.additive:
            wish -= one.next(v, x, a, field, warm, dt)
        back = self.backbone_wish(wish)
        for one in reversed(stages.yielding):
            back = one.input_for(back, level * g, v, x, level, dt)
        field += self.authority(g) * (self._exact_field(back, g, v, x, warm) - field)
        for one in reversed(stages.current):
            field = one.input_for(field, self.current_a, dt)
        self.command(min(max(field, 0.0), self._largest_a))
        self._follow(g, v, x, warm)
        return self.current_a

    def _exact_field(self, back_n: float, g: float, v: float, x: float, warm_c: float) -> float:
        """The field current in A whose static force, times the factors at that current, is back_n."""
        if not self._stages.factor:
            return self.exact_current(back_n, g, warm_c)
        was_on, factor = self._on, self._factor(self._field_a, v, x, warm_c)
        for _ in range(FACTOR_ROUNDS):
            self._on = was_on
            exact = self.exact_current(back_n / factor, g, warm_c)
            before, factor = factor, self._factor(exact, v, x, warm_c)
            if abs(factor - before) <= FACTOR_TOLERANCE * before:
                break
        return exact

    def _factor(self, current_a: float, v: float, x: float, warm_c: float) -> float:
        product = 1.0
        for one in self._stages.factor:
            product *= one.peek(v, x, current_a, warm_c, self._dt_s)
        return product

    def _follow(self, g: float, v: float, x: float, warm_c: float) -> None:
        """Bring the states that the command changes to where the command sent puts them."""
        stages, dt = self._stages, self._dt_s
        field = self.current_a
        for one in stages.current:
            field = one.next_held(field, dt)
        self._field_a = field
        level = force_level(field, warm_c, self._tables)
        back = level * g
        for one in stages.factor:
            back *= one.next(v, x, field, warm_c, dt)
        for one in stages.yielding:
            back = one.next(back, v, x, level, dt)


def needs(settings: Settings) -> frozenset[str]:
    """The signals beyond velocity, current and temperature that these effects need."""
    return frozenset(signal for pairs in settings.values() for effect, _ in pairs for signal in effect.needs)
