"""The joint model: base tables, hysteresis filter and effects fitted together on whole records.

The parameter vector is the layout's (`Layout`), then each effect's parameters in steps that matter
(`Effects`). Whatever is fitted, is fitted jointly: a base that stays as it was found without an effect
pushes its own error onto the effect.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, hysteresis
from mrctl.identify.batch import Batch, batches
from mrctl.identify.batch_forces import BatchForces
from mrctl.identify.bounds import SLOWEST_POLE, base_bounds
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.kept import Asked, WeighedSlopes
from mrctl.identify.layout import Layout, Tables
from mrctl.identify.neutral import neutral
from mrctl.identify.noise import correlation_inflation, record_noise
from mrctl.identify.parallel import in_parallel
from mrctl.identify.penalties import Penalty, base_penalties, fluid_penalties
from mrctl.identify.records import Record
from mrctl.identify.solver import Normal, covariance, solve
from mrctl.model.effects.base import Effect, Vector
from mrctl.simulate import Trace

Array = NDArray[np.float64]

WEIGHING_RATE_HZ = 500.0  # forces are compared at this rate or up to twice it; dampers do little above 100 Hz
SETTLE_TIMES = 4.0  # slowest time constants that a record's start is left out for
SETTLE_S = 0.02  # and at least: a fluid that yields has a past, too, whatever its filter
SETTLE_SHARE = 0.1  # but never more than this share of it
FLOOR_SHARE = 1e-5  # of the force scale: noise below this is no noise
EFFECT_SPREAD = 30.0  # steps that matter: the weak pull of an effect's parameters to neutral
BEND_STEP = 0.1  # of a step, over which the forces' bend is taken
MOST_KEPT = 12_000_000  # slopes, of 8 bytes each


@dataclass
class JointModel:
    """Records under one layout, with effects; what the fit, the covariance and the diagnosis ask of them.

    Not for two threads at once, as `BatchForces` is not.
    """

    layout: Layout
    records: Sequence[Record]
    effects: Effects = field(default_factory=lambda: Effects(()))
    minimum_phase: bool = False  # H's numerator positive: a lag, as a damper's; a delay is then seen as such
    slowest_pole: float = SLOWEST_POLE  # in UNIT_RAD_S: H has nothing below it
    batches: list[Batch] = field(init=False, repr=False)
    weights: Array = field(init=False, repr=False)
    noise_n: Array = field(init=False, repr=False)
    settling_s: float | None = field(init=False, repr=False, default=None)  # as a fit began; else by theta
    _forces: BatchForces = field(init=False, repr=False)
    _slopes: list[WeighedSlopes] | None = field(init=False, repr=False, default=None)
    _last: Asked | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        self.batches = batches(self.layout, self.records, self.factor)
        self.noise_n = np.full(len(self.records), 0.05 * self.layout.force_scale_n)
        self.weights = 1.0 / self.noise_n**2
        self.forget()

    def __getstate__(self) -> dict[str, object]:
        """What goes to another process: all but what is made again when asked for."""
        return {k: v for k, v in vars(self).items() if k not in {"inputs", "_forces", "_slopes", "_last"}}

    def __setstate__(self, state: dict[str, object]) -> None:
        vars(self).update(state)
        self.forget()

    @property
    def common(self) -> list[object]:
        """What models of these records share, whatever their parameters and effects."""
        return [self.layout, *self.records, *self.batches, *self.effects.chosen]

    @cached_property
    def inputs(self) -> list[base.Inputs]:
        """Each record's motion, current and temperature among the knots."""
        return [
            base.Inputs.of(self.layout, r.rate_hz, r.velocity_m_s, r.current_a, r.temperature_c)
            for r in self.records
        ]

    def on(self, records: Sequence[Record]) -> JointModel:
        """The same model on other records: held-out ones, or a part."""
        return JointModel(self.layout, records, self.effects, self.minimum_phase, self.slowest_pole)

    def placed(self, records: Sequence[Record]) -> JointModel:
        """The same model on its records with other strokes or warmths: all else is taken over."""
        model = copy(self)
        model.records = records
        model.batches = [batch.placed(records) for batch in self.batches]
        model.forget()
        return model

    def with_effects(self, effects: Effects) -> JointModel:
        """The same base on the same records with other effects; weights stay."""
        model = copy(self)
        model.effects = effects
        model.forget()
        return model

    def forget(self) -> None:
        """Let go of the kept simulations and slopes; they are made again when asked for."""
        self._forces = BatchForces(self.layout, self.effects, self.batches)
        self.forget_slopes()

    def forget_slopes(self) -> None:
        """Let go of the slopes alone, which are large."""
        self._slopes = self._last = None

    @property
    def size(self) -> int:
        """How many parameters there are, the effects' last."""
        return self.layout.size + self.effects.size

    def pack(self, tables: Tables, values: Mapping[str, Sequence[float]] | None = None) -> Array:
        """The vector of tables and effect parameters (SI); those not named are typical."""
        return np.concatenate([self.layout.pack(tables), self.effects.pack(values or {})])

    def tables(self, theta: Array) -> Tables:
        """The base model's values."""
        return self.layout.unpack(theta[: self.layout.size])

    def effect_values(self, theta: Array) -> dict[str, Vector]:
        """Each effect's parameters in SI units."""
        return self.effects.unpack(theta[self.layout.size :])

    def with_effect_at(self, theta: Array, effect: Effect, values: Vector) -> Array:
        """The vector with one of its effects at other values (SI), as far as its bounds allow."""
        own = self.effects.pack({**self.effect_values(theta), effect.name: effect.within(values)})
        return np.concatenate([theta[: self.layout.size], own])

    def neutral(self) -> Array:
        """What all parameters are taken to be where nothing is measured."""
        values = {effect.name: effect.neutral for effect in self.effects.chosen}
        return np.concatenate([neutral(self.layout), self.effects.pack(values)])

    def factor(self, record: Record) -> int:
        """Samples of a record for one that is weighed: their mean, or of a refined record the first."""
        return record.finer if record.finer > 1 else max(1, int(record.rate_hz / WEIGHING_RATE_HZ))

    def weighed(self, record: Record, x: Array) -> Array:
        """What is weighed of a record's samples (..., n): (..., n // factor)."""
        return base.in_blocks(x, self.factor(record), picked=record.finer > 1)

    def settle_blocks(self, theta: Array, record: Record) -> int:
        """Averages at the start of a record that its unknown past may still move.

        A fit goes on with those that it began with, and so does what is asked of it: were it each step's own,
        the cost would jump where a pole begins to show, and a fit stand there.
        """
        if record.starts_at_rest:
            return 0  # so its past is known
        slow = self._slowest_s(theta) if self.settling_s is None else self.settling_s
        samples = min(max(SETTLE_TIMES * slow, SETTLE_S) * record.rate_hz, SETTLE_SHARE * len(record))
        return int(samples / self.factor(record))

    def _slowest_s(self, theta: Array) -> float:
        return hysteresis.slowest_s(theta[self.layout.parts["filter"]])

    def predict(self, theta: Array) -> list[Array]:
        """Force in N of each record."""
        found: dict[int, Array] = {}
        for batch, force in zip(self.batches, self._forces.at(theta), strict=True):
            found |= zip(batch.records, batch.samples(force), strict=True)
        return [found[k] for k in range(len(self.records))]

    def traces(self, theta: Array) -> list[Trace]:
        """What happens in each batch on the way to its force."""
        return self._forces.traced(theta)

    def errors(self, theta: Array) -> list[Array]:
        """Measured less predicted force in N of each record, every sample."""
        return [r.force_n - y for r, y in zip(self.records, self.predict(theta), strict=True)]

    def residuals(self, theta: Array) -> list[Array]:
        """The errors at the weighing rate, a start of unknown past left out."""
        return [
            self.weighed(r, e)[self.settle_blocks(theta, r) :]
            for r, e in zip(self.records, self.errors(theta), strict=True)
        ]

    def rmse_n(self, theta: Array) -> float:
        """Pooled RMS error in N over every sample measured: on held-out records, the proof."""
        errors = [e[:: r.finer] for r, e in zip(self.records, self.errors(theta), strict=True)]
        return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))

    def cost(self, theta: Array) -> float:
        """Half the weighted square sum."""
        total = 0.0
        for batch, force in zip(self.batches, self._forces.at(theta), strict=True):
            rest = self.told(batch, self.block_weights(batch, theta), batch.weighed(batch.force_n - force))
            total += 0.5 * float(rest @ rest)
        return total

    def told(self, batch: Batch, roots: Array, x: Array) -> Array:  # noqa: ARG002 - what a run's say hangs on
        """What residuals or slopes (..., blocks) say, in units of the noise; in their own place.

        roots: those of the blocks' weights.
        """
        return np.multiply(x, roots, out=x)

    def block_weights(self, batch: Batch, theta: Array) -> Array:
        """The root of each block's weight: 0 where a record's past is unknown or its end is filled up."""
        roots = np.zeros(int(batch.block_starts[-1]))
        for k, part in zip(batch.records, batch.blocks(roots), strict=True):
            part[self.settle_blocks(theta, self.records[k]) :] = np.sqrt(self.weights[k])
        return roots

    def jacobians(self, theta: Array) -> Iterator[tuple[Array, base.Rows]]:
        """Record by record: residual (n) and the force's slopes (m, n) by the parameters it sees."""
        dampers = self._forces.dampers(theta)
        waiting: dict[int, tuple[Array, base.Rows]] = {}
        number = 0
        for k, record in enumerate(self.records):
            while k not in waiting:
                batch = self.batches[number]
                rest, rows = self._forces.linear(theta, number, dampers)
                parts = zip(batch.blocks(rest), batch.blocks(rows.values), strict=True)
                waiting |= {
                    n: (r, replace(rows, values=v)) for n, (r, v) in zip(batch.records, parts, strict=True)
                }
                number += 1
            rest, rows = waiting.pop(k)
            skip = self.settle_blocks(theta, record)
            yield rest[skip:], replace(rows, values=rows.values[:, skip:])

    def normal(self, theta: Array, free: NDArray[np.bool_] | None = None) -> Normal:
        """Weighted normal equations, batch by batch; slopes are kept for `bend` where they are not many.

        free: which parameters move; what is asked of the effects' others is 0. Asked again, the last ones
        are given: a fit often goes on where another stopped.
        """
        free = np.ones(self.size, dtype=bool) if free is None else free
        skips = tuple(self.settle_blocks(theta, record) for record in self.records)
        if self._last is not None and self._last.is_of(theta, free, self.weights, skips):
            return self._last.normal
        dampers = self._forces.dampers(theta)
        moves = free[self.layout.size :]
        keep = sum(b.force_n.size // b.factor for b in self.batches) * self.size <= MOST_KEPT

        def part(k: int) -> tuple[WeighedSlopes | None, NDArray[np.intp], Array, Array, float]:
            rest, rows = self._forces.linear(theta, k, dampers, moves)
            roots = self.block_weights(self.batches[k], theta)
            rest, values = (self.told(self.batches[k], roots, x) for x in (rest, rows.values))
            kept = WeighedSlopes(rows.index, values, rest, roots) if keep else None
            return kept, rows.index, values @ values.T, values @ rest, 0.5 * float(rest @ rest)

        matrix, right, cost = np.zeros((self.size, self.size)), np.zeros(self.size), 0.0
        kept = []
        for slopes_, index, own, own_right, own_cost in in_parallel(part, range(len(self.batches))):
            kept.append(slopes_)
            matrix[np.ix_(index, index)] += own
            right[index] += own_right
            cost += own_cost
        self._slopes = [one for one in kept if one is not None] if keep else None
        made = Normal(matrix, right, cost)
        self._last = Asked(theta.copy(), free.copy(), self.weights.copy(), skips, made)
        return made

    def bend(self, theta: Array, step: Array) -> Array | None:
        """J'W F'' at the last normal equations' point: F'' is the forces' second derivative along a step."""
        if self._slopes is None:
            return None
        there = theta + BEND_STEP * step
        lower, upper = self.bounds()
        if np.any((there < lower) | (there > upper)):
            return None
        pull = np.zeros(self.size)
        for batch, force, own in zip(self.batches, self._forces.at(there), self._slopes, strict=True):
            moved = own.rest - self.told(batch, own.roots, batch.weighed(batch.force_n - force))
            bent = (moved / BEND_STEP - step[own.index] @ own.values) * (2.0 / BEND_STEP)
            pull[own.index] += own.values @ bent
        return pull if np.all(np.isfinite(pull)) else None

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bound of each parameter, the effects' last."""
        rate_hz = max(r.rate_hz for r in self.records)
        own = base_bounds(self.layout, rate_hz, self.slowest_pole, minimum_phase=self.minimum_phase)
        lower, upper = (np.concatenate(pair) for pair in zip(own, self.effects.bounds(), strict=True))
        return lower, upper

    def free(self) -> NDArray[np.bool_]:
        """Which parameters a fit moves unless told otherwise: all but the effects' held ones."""
        return np.concatenate([np.ones(self.layout.size, dtype=bool), self.effects.free()])

    def penalties(self) -> list[Penalty]:
        """Smooth tables, and a weak pull to neutral that only decides what no data does."""
        own = base_penalties(self.layout, neutral(self.layout))
        if self.effects.warm:
            own += fluid_penalties(self.layout)
        found = [replace(p, rows=np.pad(p.rows, ((0, 0), (0, self.effects.size)))) for p in own]
        if self.effects.size:
            rows = np.zeros((self.effects.size, self.size))
            rows[:, self.layout.size :] = np.eye(self.effects.size) / EFFECT_SPREAD
            found.append(Penalty("effects", rows, rows @ self.neutral(), 1.0, adapts=False))
        return found

    def weigh_as(self, other: JointModel) -> None:
        """Take another model's weights, whose records are these or versions of them."""
        self.weights, self.noise_n, self.settling_s = other.weights, other.noise_n, other.settling_s

    def reweigh(self, theta: Array, *, each: bool = False) -> None:
        """Take the noise from what is left over at theta: one for all, or each record's with its colour.

        Only a converged fit may give each record its own: before, a record that fits badly would be
        weighed down and stay so.
        """
        residuals = self.residuals(theta)
        floor = FLOOR_SHARE * self.layout.force_scale_n
        if each:
            self.noise_n = record_noise(residuals, floor)
            colour = np.array([correlation_inflation(r) for r in residuals])
        else:
            pooled = float(np.sqrt(np.mean(np.concatenate(residuals) ** 2)))
            self.noise_n = np.full(len(self.records), max(pooled, floor))
            colour = np.ones(len(self.records))
        self.weights = 1.0 / (self.noise_n**2 * colour)

    def _as_fitted(self) -> JointModel:
        """The model as it is now, for what is asked of a fit when another one is on its way."""
        model = copy(self)
        model.forget_slopes()
        return model

    def fit(
        self,
        theta: Array,
        *,
        penalties: Sequence[Penalty] | None = None,
        free: NDArray[np.bool_] | None = None,
        rounds: int = 4,
        iterations: int = 8,
        tolerance: float = 0.0,
        on_round: Callable[[int, int], None] | None = None,
        passing: bool = False,
        known: float = np.inf,
    ) -> JointFit:
        """Fit from theta, in rounds: between them the evidence sets the penalties' and records' weights.

        free: which parameters move. tolerance: share of the cost that a step must win for another one.
        With one round, weights stay as they are: fits so made can be compared by their cost. passing: only
        the place that it comes to is wanted, and its cost; its normal equations are those of the step before.
        known: as `solve` has it.
        """
        penalties = self.penalties() if penalties is None else list(penalties)
        free = self.free() if free is None else free
        lower, upper = self.bounds()
        solution = None
        part = self.layout.parts["filter"]
        same = hysteresis.paired(theta[part])
        if np.all((lower[part] <= same) & (same <= upper[part])):  # cut off at a bound it is another filter
            theta = np.concatenate([theta[: part.start], same, theta[part.stop :]])
        before = self.settling_s  # an earlier fit's, whose model this may be
        for number in range(rounds):
            if number:
                self.reweigh(theta, each=True)
            least = 0.1 if number == rounds - 1 else 0.5
            self.settling_s = self._slowest_s(theta)
            solution = solve(
                partial(self.normal, free=free),
                self.cost,
                theta,
                lower,
                upper,
                penalties,
                free=free,
                iterations=iterations,
                tolerance=least,
                share=tolerance,
                bend=self.bend,
                passing=passing,
                known=known,
            )
            theta = solution.theta
            if number < rounds - 1:
                spread = covariance(solution.normal, penalties, solution.held)
                penalties = [p.reweighed(theta, spread) for p in penalties]
            if on_round is not None:
                on_round(number + 1, rounds)
        if solution is None:
            raise ValueError("a fit takes at least one round")
        done = JointFit(self._as_fitted(), solution, list(penalties))
        self.settling_s = before
        return done
