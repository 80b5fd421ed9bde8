"""A first look at a candidate: how much of the residual it would take, the model moving along its tangent.

The force's dependence on the candidate's own parameters is simulated, not linearised: a memory effect is a
state, not a regressor. Full joint fits come after, for the few candidates that look best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from mrctl.discover.fits.tangent import Tangent
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.records import Record
from mrctl.model.effects.base import Effect, Ranges, Stage, Vector

Array = NDArray[np.float64]

STEPS = 4
HALVINGS = 3
SMALLER = 0.2  # of the usual size: an effect may be far below it, ...
FAR = 10.0  # ... but on the way to a limit that is never reached there is nothing
SLOPE_STEP = 1e-3  # of a parameter's scale
SPRING_SAMPLES = 2.0  # that a spring in series adds to what is unknown of a step's time
WORTH = 0.02  # share of the gain so far that another step must promise
RARELY, MOSTLY = 0.25, 0.65  # of the samples, and of the force's square sum in them
# Shares of a slope's square, less than which a parameter can be done without: what is beyond the model, ...
ABSORBED = 3e-4
TWIN = 1e-5  # ... and beyond the effect's other parameters, as far as differences are exact


@dataclass(frozen=True, eq=False)
class Look:
    """What a candidate takes off the weighed square sum, and with which parameters (SI).

    `slopes` (own free parameters, n): how the force moves with them at that point, beyond what the model
    absorbs; `force` (n): the candidate's own force beyond it.
    """

    effect: Effect
    gain: float
    values: Vector
    force: Array
    slopes: Array
    settled: Array  # the model's vector, settled around the candidate's force
    plausible: bool  # whether these values still describe the effect
    usual_force: float  # square sum of the force at the usual size, in units of the noise ...
    usual_beyond: float  # ... and of what the model does not take up
    free: NDArray[np.bool_]  # which parameters this data can move: not those held, nor those absorbed

    @property
    def acts_rarely(self) -> bool:
        """Whether most of the force's square sum is in a small part of the samples."""
        squares = np.sort(self.force**2)
        few = squares[-max(1, round(RARELY * squares.size)) :]
        return float(few.sum()) > MOSTLY * float(squares.sum())


def ranges_of(r: Sequence[Record]) -> Ranges:
    """The largest absolute values in the records."""
    return Ranges(
        max(float(np.max(np.abs(one.displacement_m))) for one in r),
        max(float(np.max(np.abs(one.velocity_m_s))) for one in r),
        max(float(np.max(one.current_a)) for one in r),
        max(float(np.quantile(np.abs(one.force_n), 0.995)) for one in r),
        max(0.0, *(-float(np.quantile(one.force_n, 0.005)) for one in r)),
        max(one.finer / one.rate_hz for one in r),
    )


def reach_of(model: JointModel) -> Ranges:
    """The ranges of a model's records, as far as it can tell when a current stepped.

    What a spring in series does within a sample after a step is not told by the motion at the samples.
    """
    ranges = ranges_of(model.records)
    if all(e.stage is not Stage.MOTION for e in model.effects.chosen):
        return ranges
    return ranges._replace(sample_s=ranges.sample_s + SPRING_SAMPLES / min(r.rate_hz for r in model.records))


class Screen:
    """Looks at candidates beside one fitted model."""

    def __init__(self, tangent: Tangent, ranges: Ranges | None = None) -> None:
        self.tangent = tangent
        self.base = tangent.fit.model
        self.ranges = reach_of(self.base) if ranges is None else ranges
        self.here = tangent.stacked(self.base.predict(tangent.fit.theta))

    def glance(self, effect: Effect) -> list[tuple[float, Vector]]:
        """For each starting point, the gain that one linear step promises."""
        return [
            (self._Trial(self, effect).promise(np.array(start)), start)
            for start in _starts(effect, self.ranges)
        ]

    def climb(self, effect: Effect, start: Vector) -> Look:
        """The look from a starting point, moved to where the candidate takes most."""
        return self._Trial(self, effect).climb(np.array(start))

    def at(self, effect: Effect, values: Vector) -> Look:
        """The look at given parameters, not moved."""
        return self._Trial(self, effect).look(np.array(values))

    class _Trial:
        """One effect beside the model: its force at any of its parameters."""

        def __init__(self, screen: Screen, effect: Effect) -> None:
            self._screen = screen
            self._tangent = screen.tangent
            self._effect = effect
            chosen = screen.base.effects.chosen
            # A first look is worth no more than that what carries the damper stays as it is.
            self._model = screen.base.with_effects(Effects((*chosen, replace(effect, felt=False))))
            self._scales = np.array([p.step_scale for p in effect.parameters])
            self._lower = np.array([p.low for p in effect.parameters])
            self._upper = np.array([p.high for p in effect.parameters])
            self._free = np.array([not p.held for p in effect.parameters])

        def _force(self, values: Array) -> Array:
            theta = np.concatenate([self._tangent.fit.theta, values / self._scales])
            return self._tangent.stacked(self._model.predict(theta)) - self._screen.here

        def _gain(self, force: Array) -> float:
            """How far the penalised square sum falls when the model settles around this force."""
            beyond = self._tangent.products_beyond(force[None])[0, 0]
            return float(2.0 * force @ self._tangent.residual - beyond)

        def _slopes(self, values: Array, force: Array) -> Array:
            rows = []
            for k in np.flatnonzero(self._free):
                small = SLOPE_STEP * self._scales[k]
                if values[k] + small > self._upper[k]:
                    small = -small
                moved = values.copy()
                moved[k] += small
                rows.append((self._force(moved) - force) * (self._scales[k] / small))
            return np.array(rows).reshape(len(rows), force.size)

        def look(self, values: Array) -> Look:
            force = self._force(values)
            return self._look(self._gain(force), values, force)

        def _look(self, gain: float, values: Array, force: Array) -> Look:
            """The look at these parameters, whose own force (n) is given."""
            slopes = self._slopes(values, force)
            beyond = self._tangent.beyond(np.concatenate([force[None], slopes]))
            return Look(
                self._effect,
                gain,
                tuple(values.tolist()),
                beyond[0],
                beyond[1:],
                self._tangent.moved(force),
                self._effect.describes(tuple(values.tolist()), self._screen.ranges),
                *self._usual(),
                self._free.copy(),
            )

        def _leave_out_far(self, values: Array) -> None:
            """Hold what no tangent shows where a look begins without it."""
            both = zip(self._effect.parameters, values, strict=True)
            self._free &= np.array([not (p.far and x == p.neutral) for p, x in both])

        def _hold_absorbed(self, values: Array) -> tuple[Array, Array, Array]:
            """Leave to the model what its own parameters do as well: such a parameter goes to neutral.

            So does an optional one that here only does what the effect's parameters before it do. Returns the
            values, the force there and its slopes.
            """
            before = values
            force = self._force(values)
            slopes = self._slopes(values, force)
            size = np.sum(slopes**2, axis=1)
            gram = self._tangent.products_beyond(slopes)
            values = values.copy()
            kept: list[int] = []
            for row, k in enumerate(np.flatnonzero(self._free)):
                parameter = self._effect.parameters[k]
                absorbed = size[row] > 0.0 and gram[row, row] < ABSORBED * size[row]
                if absorbed or (parameter.optional and _beside(gram, kept, row) <= TWIN * size[row]):
                    values[k] = parameter.neutral
                    self._free[k] = False
                else:
                    kept.append(row)
            if np.array_equal(values, before):
                return values, force, slopes[kept]
            force = self._force(values)
            return values, force, self._slopes(values, force)

        def _usual(self) -> tuple[float, float]:
            """The square sum of the force at the typical parameters, and of its part beyond the model."""
            force = self._force(np.array(self._effect.typical))
            return float(force @ force), float(self._tangent.products_beyond(force[None])[0, 0])

        def promise(self, values: Array) -> float:
            """What the best linear step from here would gain."""
            self._leave_out_far(values)
            force = self._force(values)
            slopes = self._slopes(values, force)
            return self._step(values, np.concatenate([force[None], slopes]))[1]

        def _step(self, values: Array, rows: Array) -> tuple[Array, float]:
            """The best linear step from parameters whose force and slopes are the rows, and what it gains."""
            beyond, by_residual = self._tangent.products_beyond(rows), rows @ self._tangent.residual
            low, high = ((b - values) / self._scales for b in (self._lower, self._upper))
            right = by_residual[1:] - beyond[0, 1:]
            step = _bounded_step(beyond[1:, 1:], right, low[self._free], high[self._free])
            whole = np.concatenate([[1.0], step])
            return step, float(2.0 * whole @ by_residual - whole @ beyond @ whole)

        def climb(self, values: Array) -> Look:
            """Gauss-Newton steps within the bounds."""
            self._leave_out_far(values)
            values, force, slopes = self._hold_absorbed(values)
            free = self._free
            if not free.any():
                return self._look(0.0, values, np.zeros(force.size))
            gain = self._gain(force)
            for number in range(STEPS):
                if number:
                    slopes = self._slopes(values, force)
                step, _ = self._step(values, np.concatenate([force[None], slopes]))
                for _ in range(HALVINGS):
                    trial = values.copy()
                    trial[free] += step * self._scales[free]
                    trial = np.clip(trial, self._lower, self._upper)
                    there = self._force(trial)
                    better = self._gain(there)
                    if better > gain:
                        break
                    step = 0.25 * step
                else:
                    break
                won, values, force, gain = better - gain, trial, there, better
                if won < WORTH * max(gain, 1.0):
                    break
            return self._look(gain, values, force)


def _beside(gram: Array, kept: list[int], row: int) -> float:
    """The square of a slope's part orthogonal to those kept, of their Gram matrix."""
    across = gram[kept, row]
    return float(gram[row, row] - across @ np.linalg.pinv(gram[np.ix_(kept, kept)], hermitian=True) @ across)


def _starts(effect: Effect, ranges: Ranges) -> list[Vector]:
    """The effect's own starting points, and smaller ones where its force is not in proportion to it."""
    points = effect.starting_points(ranges)
    far = any(abs(p.neutral) > FAR * abs(x) for p, x in zip(effect.parameters, points[0], strict=True))
    if far or all(p.linear or p.held for p in effect.parameters):
        return points
    smaller = [
        tuple(n + SMALLER * (x - n) for x, n in zip(point, effect.neutral, strict=True)) for point in points
    ]
    return list(dict.fromkeys([*points, *smaller]))


def _bounded_step(normal: Array, right: Array, lower: Array, upper: Array) -> Array:
    """The step that minimises the quadratic within bounds."""
    size = np.sqrt(np.maximum(np.diag(normal), 1e-30))
    power, axes = np.linalg.eigh(normal / np.outer(size, size))
    power = np.maximum(power, 2e-9)  # differences that rounding made parallel
    root = axes * np.sqrt(power)
    target = (axes.T @ (right / size)) / np.sqrt(power)
    low, high = np.minimum(lower * size, 0.0) - 1e-12, np.maximum(upper * size, 0.0) + 1e-12
    return np.asarray(lsq_linear(root.T, target, (low, high), method="bvls").x / size, dtype=np.float64)
