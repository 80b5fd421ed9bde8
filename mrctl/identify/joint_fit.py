"""A fitted joint model: where the fit stopped, and how sure its parameters are."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.layout import Tables
from mrctl.identify.noise import coloured_gram
from mrctl.identify.penalties import Penalty, total_weight, weighed_as
from mrctl.identify.solver import Normal, Solution, covariance, scaled_solution
from mrctl.model.effects.base import Vector

if TYPE_CHECKING:
    from mrctl.identify.joint import JointModel

Array = NDArray[np.float64]

FEWEST_TO_DISAGREE = 4  # records, for their disagreement to say something
RIDGE = 1e-10  # of each parameter's own information, against rounding
NORMAL_95 = 1.96
# What sampled signals and a form that is only near the truth leave in a parameter, noise and all, over what
# noise leaves alone. Found on one draw of the hidden-effect battery (seed 201), where 1 covered seven in ten.
FORM_DOUBT = 2.0
LEFT_OUT = 0.9  # of a record: what one alone knows would have no value at all without it


@dataclass
class JointFit:
    """A fitted joint model: its vector, how the fit stopped, and the penalties in force."""

    model: JointModel
    solution: Solution
    penalties: list[Penalty]

    @property
    def theta(self) -> Array:
        """The parameters."""
        return self.solution.theta

    @property
    def tables(self) -> Tables:
        """The base model's values."""
        return self.model.tables(self.theta)

    @property
    def total(self) -> float:
        """Half the weighted square sum, and what the penalties add."""
        data = self.model.cost(self.theta)
        return data + sum(0.5 * p.weight * p.excess(self.theta) for p in self.penalties)

    @property
    def effect_values(self) -> dict[str, Vector]:
        """Each effect's parameters in SI units."""
        return self.model.effect_values(self.theta)

    @property
    def moving(self) -> NDArray[np.bool_]:
        """What moves in the next fit: the base, and of the effects what moved or stood at a bound."""
        lower, upper = self.model.bounds()
        free = ~self.solution.held | (self.theta <= lower) | (self.theta >= upper)
        free[: self.model.layout.size] = True
        return free & self.model.free()

    def less(self, names: Container[str]) -> JointFit:
        """The model without effects of these names, all else where it stands: nothing is fitted anew."""
        effects, stays = self.model.effects.less(names)
        keep = np.concatenate([np.ones(self.model.layout.size, dtype=bool), stays])
        model, old = self.model.with_effects(effects), self.solution
        normal = replace(
            old.normal, matrix=old.normal.matrix[np.ix_(keep, keep)], right=old.normal.right[keep]
        )
        solution = replace(old, theta=old.theta[keep], normal=normal, held=old.held[keep])
        return JointFit(model, solution, weighed_as(self.penalties, model.penalties()))

    def covariance(self) -> Array:
        """Covariance of the vector under coloured noise; 0 for what was held.

        The residual's colour is an autoregressive model, record by record; the spread is then
        V (J' W S W J + P) V, with V the inverse of J' W J + P and P the penalties. Where the records pull a
        parameter about more than such noise would, as a model that is not quite right makes them, its spread
        is theirs: what the fit would move by without one or the other (the jackknife over records, to first
        order; Efron, Stein, Ann. Stat. 9 (1981)). A pole or zero at a bound is not known for that: it
        counts as free, else what trades with it, as a delay does, would seem far surer than it is.
        """
        model, theta = self.model, self.theta
        held = self.solution.held.copy()
        held[model.layout.parts["filter"]] = False
        size = model.size
        bread, meat = np.zeros((size, size)), np.zeros((size, size))
        own: list[tuple[NDArray[np.intp], Array, Array]] = []
        for weight, (rest, rows) in zip(model.weights, model.jacobians(theta), strict=True):
            at = np.ix_(rows.index, rows.index)
            own.append((rows.index, weight * (rows.values @ rows.values.T), weight * (rows.values @ rest)))
            bread[at] += own[-1][1]
            meat[at] += weight**2 * coloured_gram(rows.values, rest)
        normal = Normal(bread, np.zeros(size), 0.0)
        inverse = covariance(normal, self.penalties, held)
        prior = total_weight(self.penalties)
        spread = np.asarray(inverse @ (meat + prior) @ inverse, dtype=np.float64)
        count = len(own)
        if count < FEWEST_TO_DISAGREE:
            return spread
        moved = np.array([_without(bread + prior, held, *one) for one in own])
        pulled = (count - 1) * np.var(moved, axis=0)
        more = np.sqrt(np.maximum(pulled / np.maximum(np.diag(spread), 1e-300), 1.0))
        return np.asarray(spread * np.outer(more, more), dtype=np.float64)

    def effect_std(self, covariance: Array | None = None) -> dict[str, Vector]:
        """Standard deviation of each effect's parameters in SI units."""
        spread = np.sqrt(np.maximum(np.diag(self.covariance() if covariance is None else covariance), 0.0))
        own = spread[self.model.layout.size :]
        values: dict[str, Vector] = {}
        at = 0
        for effect in self.model.effects.chosen:
            part = own[at : at + len(effect.parameters)]
            values[effect.name] = tuple(
                float(s * p.step_scale) for s, p in zip(part, effect.parameters, strict=True)
            )
            at += len(effect.parameters)
        return values

    def effect_correlation(self, name: str) -> Array:
        """How the parameters of an effect that is in the model go together (n, n); 0 for those held."""
        chosen = self.model.effects.chosen
        place = [effect.name for effect in chosen].index(name)
        at = self.model.layout.size + sum(len(effect.parameters) for effect in chosen[:place])
        own = slice(at, at + len(chosen[place].parameters))
        spread = self.covariance()[own, own]
        std = np.sqrt(np.maximum(np.diag(spread), 1e-300))
        return np.asarray(spread / np.outer(std, std), dtype=np.float64)


def half_width_95(std: float) -> float:
    """Half the 95 % interval of an effect's parameter of a standard deviation, form and all; in its unit."""
    return NORMAL_95 * FORM_DOUBT * std


def _without(
    normal: Array, held: NDArray[np.bool_], index: NDArray[np.intp], own: Array, pull: Array
) -> Array:
    """How far a fit moves, to first order, when most of a record with these normal equations is left out."""
    less, step = normal.copy(), np.zeros(held.size)
    less[np.ix_(index, index)] -= LEFT_OUT * own
    step[index] = -pull
    move = np.flatnonzero(~held)
    moved = np.zeros(held.size)
    moved[move] = scaled_solution(less[np.ix_(move, move)], step[move], RIDGE, np.diag(normal)[move])
    return moved
