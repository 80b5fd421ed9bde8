"""What a small step of an effect's parameter changes at a given motion of the piston, which then gives way.

Simulated again for each of them, the balance of a mount and of all that it carries is what takes longest of a
fit; at a given motion it costs next to nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import filtering
from mrctl.identify.effects_fit import Effects
from mrctl.identify.motion_slopes import SLOPE_STEP, Motion, as_arrays, away
from mrctl.model.beside import ALONE, preload
from mrctl.model.effects.base import Effect, Stage, Vector
from mrctl.simulate import loops, stages
from mrctl.simulate.compiled import compiled

Array = NDArray[np.float64]

NEAR = 1e-3  # of a motion effect's parameter, that a step is at most: one over a compliance bends


@dataclass(frozen=True, eq=False)
class Change:
    """What a step of one parameter changes at a given motion, (n) each, in N over the parameter's step."""

    number: int  # the parameter's, among all effects'
    static: Array | None = None  # of f g h and what multiplies it, which the motion feels behind its lag
    felt: Array | None = None  # of what else the motion feels
    beside: Array | None = None
    on_rod: Array | None = None


def changes_of(motion: Motion, effects: Effects, theta: Array, asked: Iterable[int]) -> list[Change]:
    """Those of the parameters asked for that it is known of: what the piston feels, and what bends it.

    theta: the effects' parameters, in their steps.
    """
    _, upper = effects.bounds()
    values = effects.unpack(theta)
    gives, _, _ = motion.giving_way
    found = []
    for k in asked:
        effect, _ = effects.parameters[k]
        if effect.stage is Stage.MOTION:
            if effect is not gives or values[effect.name][0] <= 0.0:  # what does not give way bears any force
                continue
        elif effect.stage not in (Stage.FACTOR, Stage.ADDITIVE, Stage.ROD) or not effect.felt:
            continue
        small = away(theta[k], upper[k])
        if effect.stage is Stage.MOTION and theta[k] > 0.0:
            small = float(np.copysign(min(SLOPE_STEP, NEAR * theta[k]), small))
        there = theta.copy()
        there[k] += small
        found.append(_change(motion, int(k), effect, effects.unpack(there)[effect.name], small))
    return found


def _change(motion: Motion, number: int, effect: Effect, p: Vector, small: float) -> Change:
    here, run = motion.here, motion.here.run
    v, x, warm = here.velocity_m_s, here.displacement_m, here.temperature_c
    if effect.stage is Stage.MOTION:
        return Change(number, felt=_bending(motion, p) / small)
    if effect.stage is Stage.FACTOR:
        moved = stages.factor(effect, p, v, x, here.current_a, warm, run.dt_s, run.starts)
        moved -= here.factors[effect.name]
        for name, factor in here.factors.items():
            if name != effect.name:
                moved *= factor
        return Change(number, static=here.level_n * here.shape * moved / small)
    on_rod = effect.stage is Stage.ROD
    signals = v, x, run.acceleration_m_s2, here.current_a, warm
    force = stages.additive(effect, p, *signals, run.dt_s, run.starts)
    force -= (here.rod_n if on_rod else here.additive_n)[effect.name]
    force /= small
    before = dict(motion.settings[effect.stage])[effect]
    felt = force.copy()
    for begin, end in zip(run.starts[:-1], run.starts[1:], strict=True):
        still = float(here.current_a[begin]), float(warm[begin]), run.dt_s
        felt[begin:end] -= (preload([(effect, p)], *still) - preload([(effect, before)], *still)) / small
        felt[begin] = 0.0  # a first state does not hang on it
    return Change(number, felt=felt, **{"on_rod" if on_rod else "beside": force})


def _bending(motion: Motion, p: Vector) -> Array:
    """The force in N (n) that would bend the motion's effect as other parameters of it do.

    Which is what it bears less at the same bending, and what its own lag makes of the static force.
    """
    here, run = motion.here, motion.here.run
    effect, before, way = motion.giving_way
    given_m = run.displacement_m - here.displacement_m
    given_m_s = run.velocity_m_s - here.velocity_m_s
    firsts = [_first(motion, int(begin), (before, p)) for begin in run.starts[:-1]]
    loop = compiled(loops.bears, way.bears, f"{effect.name}_bears")
    borne = np.empty((2, run.size))
    for q, out in zip((before, p), borne, strict=True):
        loop(q, np.zeros((len(firsts), firsts[0][0].size)), run.starts, given_m, given_m_s, run.dt_s, out)
    felt: Array = borne[0] - borne[1]
    lags = [motion.lag_inside(motion.filter, q) for q in (before, p)]
    if lags[0] != lags[1]:
        was, now = (filtering.filtered(*as_arrays(lag), here.static_n, run.starts) for lag in lags)
        felt += now - was
    for begin, (was, now) in zip(run.starts[:-1], firsts, strict=True):
        # At first the force that makes the state what other parameters make it.
        by_force = np.array(way.start(before, 1.0, float(given_m[begin])))
        size = float(by_force @ by_force)
        felt[begin] = float(by_force @ (now - was)) / size if size > 0.0 else 0.0
    return felt


def _first(motion: Motion, begin: int, each: Sequence[Vector]) -> list[Array]:
    """The first states of a stretch that begins there, by each of several vectors of the motion's effect."""
    here, run = motion.here, motion.here.run
    effect, _, _ = motion.giving_way
    factor = float(np.prod([one[begin] for one in here.factors.values()]))
    signals = run.velocity_m_s, run.displacement_m, here.current_a, here.temperature_c
    first = [float(u[begin]) for u in signals]
    held = factor, *ALONE[1:], motion.tables, motion.plain_lag(motion.filter), run.dt_s
    return [np.array(effect.initial(q, *first, *held)) for q in each]
