"""Whether an effect keeps what every effect promises, tried out on a damper; for authors of effects."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from mrctl.errors import InputError
from mrctl.model.damper import Damper
from mrctl.model.effects.base import Effect, Settings, Vector
from mrctl.model.effects.faults import faults
from mrctl.model.pipeline import ForwardPipeline
from mrctl.simulate.run import Array, Run
from mrctl.simulate.trace import trace

CLOSE = 1e-9  # vehicle against desk, relative to the largest force


def broken_promises(effect: Effect, damper: Damper, dt_s: float = 0.001) -> list[str]:
    """What the effect fails to keep, in words; empty when it is sound.

    Its description is whole; neutral changes nothing; the force is finite at every corner of the bounds;
    the vehicle's floats and the desk's compiled code agree; its usual size changes the force at all.
    """
    found = faults(effect) or failures(effect, damper, dt_s)
    if found:
        return found
    trial = _Trial(effect, damper, dt_s)
    if not np.array_equal(trial.force(effect.neutral), trial.before.force_n):
        found.append("its neutral values change the force")
    desk = trial.force(effect.typical)
    if np.array_equal(desk, trial.before.force_n):
        found.append("its typical values do not change the force")
    try:
        vehicle = _by_sample(effect, trial.base, trial.run)
    except (ArithmeticError, ValueError) as error:
        return [*found, f"in plain Python it fails ({error}), compiled it does not"]
    if not np.max(np.abs(desk - vehicle)) <= CLOSE * np.max(np.abs(desk)):
        found.append("compiled, it gives another force than in plain Python")
    return found


def failures(effect: Effect, damper: Damper, dt_s: float = 0.001) -> list[str]:
    """What no fit could get over: it does not compile, divides by zero, or its force is not finite."""
    trial = _Trial(effect, damper, dt_s)
    corners = product(*((p.low, p.high) for p in effect.parameters))
    try:
        for values in (effect.neutral, effect.typical, *corners):
            if not np.all(np.isfinite(trial.force(values))):
                at = ", ".join(f"{p.name} {x:g}" for p, x in zip(effect.parameters, values, strict=True))
                return [f"the force is not finite within its bounds, at {at}"]
    except InputError as error:
        return [problem.what for problem in error.problems]
    return []


class _Trial:
    """A damper without effects over a rich run, and the force that an effect makes of it."""

    def __init__(self, effect: Effect, damper: Damper, dt_s: float) -> None:
        self.effect = effect
        self.base = replace(damper, effects=())
        self.run = rich_run(dt_s, damper.current_max_a)
        self.before = trace(self.run, self.base)

    def force(self, p: Vector) -> Array:
        """The force in N (n)."""
        return trace(self.run, self.base, settings=_only(self.effect, p), like=self.before).force_n


def rich_run(dt_s: float, current_max_a: float, seconds: float = 2.0) -> Run:
    """Two sines of motion up to 25 mm and 0.4 m/s, the current in steps and ramps, a warming case."""
    t = np.arange(round(seconds / dt_s)) * dt_s
    slow, fast = 2.0 * np.pi * 1.3, 2.0 * np.pi * 6.1
    x = 0.018 * np.sin(slow * t) + 0.007 * np.sin(fast * t + 1.0)
    v = 0.018 * slow * np.cos(slow * t) + 0.007 * fast * np.cos(fast * t + 1.0)
    a = -0.018 * slow**2 * np.sin(slow * t) - 0.007 * fast**2 * np.sin(fast * t + 1.0)
    steps = np.array([0.0, 0.5, 0.1, 0.8, 0.3, 0.0, 1.0, 0.05])[(8.0 * t / (0.5 * seconds)).astype(int) % 8]
    ramps = 0.5 + 0.5 * np.sin(2.0 * np.pi * 0.9 * t)
    current = current_max_a * np.where(t < 0.5 * seconds, steps, ramps)
    return Run.of(dt_s, v, current, 30.0 + 40.0 * t / seconds, x, a)


def _by_sample(effect: Effect, base: Damper, run: Run) -> Array:
    model = ForwardPipeline(base, run.dt_s, settings=_only(effect, effect.typical))
    signals = run.velocity_m_s, run.current_a, run.temperature_c, run.displacement_m, run.acceleration_m_s2
    samples = list(zip(*(signal.tolist() for signal in signals), strict=True))
    model.settle(*samples[0])
    return np.array([model.step(*sample) for sample in samples])


def _only(effect: Effect, p: Vector) -> Settings:
    return {effect.stage: ((effect, p),)}
