"""What every effect has to keep, as functions of an effect; the tests apply them to each one."""

from __future__ import annotations

import numpy as np
from conftest import RATE_HZ, make_damper, with_effects
from scipy.optimize import least_squares

from mrctl.model.damper import Damper
from mrctl.model.effects.base import Effect, Ranges, Vector
from mrctl.model.pipeline import ForwardPipeline, InversePipeline
from mrctl.simulate import Run, simulate, trace

THE_TRUTH = 1e-16  # of the force's square sum, that a fit leaves which no other start can better


def extended(effect: Effect, p: Vector, rate_hz: float = RATE_HZ) -> Damper:
    return with_effects(make_damper(rate_hz), **{effect.name: effect.mapping(p)})


def force(damper: Damper, run: Run) -> np.ndarray:
    return trace(run, damper).force_n


def samples(run: Run) -> list[tuple[float, float, float, float, float]]:
    """Velocity, current, temperature, displacement, acceleration of each sample, as plain floats."""
    signals = run.velocity_m_s, run.current_a, run.temperature_c, run.displacement_m, run.acceleration_m_s2
    return list(zip(*(signal.tolist() for signal in signals), strict=True))


def by_sample(damper: Damper, run: Run) -> np.ndarray:
    """The force as the vehicle computes it."""
    model = ForwardPipeline(damper, run.dt_s)
    model.settle(*samples(run)[0])
    return np.array([model.step(*sample) for sample in samples(run)])


def other_than_typical(effect: Effect) -> Vector:
    """A vector to be found again: typical, moved by a third of each scale, held ones left."""
    return tuple(
        p.typical if p.held else min(max(p.typical + p.step_scale / 3.0, p.low), p.high)
        for p in effect.parameters
    )


def recovered(effect: Effect, truth: Vector, run: Run) -> Vector:
    """The parameters that least squares finds in the force that the truth makes, the base known."""
    base = trace(run, make_damper())
    measured = trace(run, extended(effect, truth), like=base).force_n
    free = [k for k, p in enumerate(effect.parameters) if not p.held]
    scale = np.array([effect.parameters[k].step_scale for k in free])
    low = np.array([effect.parameters[k].low for k in free]) / scale
    high = np.array([effect.parameters[k].high for k in free]) / scale

    def vector(u: np.ndarray) -> Vector:
        p = list(truth)
        for k, value in zip(free, u * scale, strict=True):
            p[k] = min(max(float(value), effect.parameters[k].low), effect.parameters[k].high)
        return tuple(p)

    def residual(u: np.ndarray) -> np.ndarray:
        return trace(run, extended(effect, vector(u)), like=base).force_n - measured

    reach = Ranges(
        *(float(np.max(np.abs(s))) for s in (run.displacement_m, run.velocity_m_s, run.current_a, measured))
    )
    fits = []
    for point in effect.starting_points(reach):
        begin = np.clip([point[k] for k in free] / scale, low, high)
        fits.append(
            least_squares(
                residual, begin, bounds=(low, high), xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=200
            )
        )
        if fits[-1].cost < THE_TRUTH * float(measured @ measured):
            break
    return vector(min(fits, key=lambda fit: fit.cost).x)


def tracking_rmse(model: Damper, truth: Damper, run: Run, current_a: np.ndarray) -> float:
    """How far the true damper's force is from what it gives with current_a, when the model has to find it."""
    wish = simulate(
        truth,
        run.dt_s,
        run.velocity_m_s,
        current_a,
        run.temperature_c,
        run.displacement_m,
        run.acceleration_m_s2,
    )
    inverse, damper = InversePipeline(model, run.dt_s), ForwardPipeline(truth, run.dt_s)
    inverse.reset(float(wish[0]), float(current_a[0]))
    error = []
    for (v, _, temperature, x, a), wanted in zip(samples(run), wish.tolist(), strict=True):
        command = inverse.step(wanted, v, temperature, x, a)
        assert 0.0 <= command <= model.current_max_a
        error.append(damper.step(v, command, temperature, x, a) - wanted)
    settled = len(error) // 10  # the damper starts at rest, in the middle of a motion
    return float(np.sqrt(np.mean(np.square(error[settled:]))))
