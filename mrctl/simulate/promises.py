"""Whether an effect keeps what every effect promises, tried out on a damper; for authors of effects."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from mrctl.errors import InputError
from mrctl.model.damper import Damper
from mrctl.model.effects.base import SIGNALS, Effect, Settings, Vector
from mrctl.model.effects.faults import faults
from mrctl.model.pipeline import ForwardPipeline
from mrctl.simulate.run import Array, Run
from mrctl.simulate.trace import trace

CLOSE = 1e-9  # vehicle against desk, relative to the largest force
AT_REST = 0.05  # of a run that ends where all that a step may divide by is 0
TRIED = 200  # samples of a run in plain Python before it is compiled
# What a step of the user's own may raise.
_FAULTS = ArithmeticError, AttributeError, LookupError, NameError, TypeError, ValueError


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
        runs = trial.run, *_without(effect, trial.run)
        vehicle, *others = (_by_sample(effect, trial.base, run) for run in runs)
    except _FAULTS as error:
        return [*found, f"in plain Python it fails ({_where(effect, error)}), compiled it does not"]
    if any(not np.array_equal(vehicle, other) for other in others):
        found.append('its force hangs on what `needs` does not name: "displacement" or "acceleration"')
    if not np.max(np.abs(desk - vehicle)) <= CLOSE * np.max(np.abs(desk)):
        found.append("compiled, it gives another force than in plain Python")
    return found


def failures(effect: Effect, damper: Damper, dt_s: float = 0.001) -> list[str]:
    """What no fit could get over: it fails, does not compile, or its force is not finite.

    Compiled code does not look whether a state is there: plain Python goes first.
    """
    trial = _Trial(effect, damper, dt_s)
    try:
        _by_sample(effect, trial.base, trial.run, [*range(TRIED), *range(-TRIED, 0)])
    except _FAULTS as error:
        return [f"it fails, {_where(effect, error)}"]
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
    for signal in (x, v, a, current):
        signal[t > (1.0 - AT_REST) * seconds] = 0.0
    return Run.of(dt_s, v, current, 30.0 + 40.0 * t / seconds, x, a)


def _by_sample(effect: Effect, base: Damper, run: Run, tried: Sequence[int] | None = None) -> Array:
    model = ForwardPipeline(base, run.dt_s, settings=_only(effect, effect.typical))
    signals = run.velocity_m_s, run.current_a, run.temperature_c, run.displacement_m, run.acceleration_m_s2
    of = slice(None) if tried is None else np.array(tried)
    samples = list(zip(*(signal[of].tolist() for signal in signals), strict=True))
    model.settle(*samples[0])
    return np.array([model.step(*sample) for sample in samples])


def _only(effect: Effect, p: Vector) -> Settings:
    return {effect.stage: ((effect, p),)}


def _without(effect: Effect, run: Run) -> list[Run]:
    """The run without each of the signals that the effect does not need."""
    still = np.zeros(run.size)
    without = {
        "displacement": replace(run, displacement_m=still),
        "acceleration": replace(run, acceleration_m_s2=still),
    }
    return [without[signal] for signal in sorted(SIGNALS - effect.needs)]


def _where(effect: Effect, error: Exception) -> str:
    """The line of the effect's file that an error came from, and what it says."""
    file = effect.step.__code__.co_filename
    own = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    what = f"line {own[-1]}: {error}" if own else str(error)
    return what + (
        "; a state is made by `start`, and named in `states`" if isinstance(error, IndexError) else ""
    )
