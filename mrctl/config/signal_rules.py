"""What each kind of signal must keep to: age, range, rate of change, and how long it can be stood in for."""

from __future__ import annotations

from pydantic import Field

from mrctl.yaml_source import StrictModel


class SignalRules(StrictModel):
    """Plausibility of one role's signals; limits in the signal's unit."""

    timeout_ms: float = Field(gt=0.0, le=60_000.0, description="older than this, a value is not used")
    minimum: float = Field(description="smallest plausible value")
    maximum: float = Field(description="largest plausible value")
    rate_max: float = Field(gt=0.0, description="largest plausible change, per second")
    limp_after_ms: float | None = Field(
        default=None, gt=0.0, description="so long after it was good it can be stood in for; null: for ever"
    )
    frozen_after_ms: float | None = Field(
        default=None,
        gt=0.0,
        description="exactly the same for longer, and not near 0, a value is not used; null: never judged",
    )


class RelativeVelocityRules(SignalRules):
    """Damper velocity, m/s: nothing can stand in for it for long."""

    timeout_ms: float = Field(default=10.0, gt=0.0, le=60_000.0)
    minimum: float = -2.0
    maximum: float = 2.0
    rate_max: float = Field(default=500.0, gt=0.0)
    limp_after_ms: float | None = Field(default=50.0, gt=0.0)
    frozen_after_ms: float | None = Field(default=1000.0, gt=0.0)


class BodyVelocityRules(SignalRules):
    """Body velocity, m/s: without it the wish is a constant damping."""

    timeout_ms: float = Field(default=50.0, gt=0.0, le=60_000.0)
    minimum: float = -4.0
    maximum: float = 4.0
    rate_max: float = Field(default=100.0, gt=0.0)
    frozen_after_ms: float | None = Field(default=1000.0, gt=0.0)


class BodyAccelerationRules(SignalRules):
    """Body acceleration, m/s2: without it the wish is a constant damping."""

    timeout_ms: float = Field(default=50.0, gt=0.0, le=60_000.0)
    minimum: float = -40.0
    maximum: float = 40.0
    rate_max: float = Field(default=10_000.0, gt=0.0)


class TemperatureRules(SignalRules):
    """Case temperature, degC: changes slowly, its last value holds."""

    timeout_ms: float = Field(default=1000.0, gt=0.0, le=60_000.0)
    minimum: float = -50.0
    maximum: float = 200.0
    rate_max: float = Field(default=20.0, gt=0.0)


class DisplacementRules(SignalRules):
    """Damper stroke, m."""

    timeout_ms: float = Field(default=50.0, gt=0.0, le=60_000.0)
    minimum: float = -0.2
    maximum: float = 0.2
    rate_max: float = Field(default=5.0, gt=0.0)


class ForceRules(SignalRules):
    """Measured force, N: for the record, no law uses it."""

    timeout_ms: float = Field(default=50.0, gt=0.0, le=60_000.0)
    minimum: float = -8000.0
    maximum: float = 8000.0
    rate_max: float = Field(default=2.0e6, gt=0.0)


class ForceWishRules(SignalRules):
    """Desired force from outside, N: without it the wish is a constant damping."""

    timeout_ms: float = Field(default=50.0, gt=0.0, le=60_000.0)
    minimum: float = -8000.0
    maximum: float = 8000.0
    rate_max: float = Field(default=2.0e6, gt=0.0)


class SignalRulesFile(StrictModel):
    """The rules by role."""

    relative_velocity: RelativeVelocityRules = RelativeVelocityRules()
    body_velocity: BodyVelocityRules = BodyVelocityRules()
    body_acceleration: BodyAccelerationRules = BodyAccelerationRules()
    temperature: TemperatureRules = TemperatureRules()
    displacement: DisplacementRules = DisplacementRules()
    force: ForceRules = ForceRules()
    force_wish: ForceWishRules = ForceWishRules()

    def by_role(self) -> dict[str, SignalRules]:
        """The rules as a mapping from role."""
        return {role: getattr(self, role) for role in type(self).model_fields}
