"""The joint model: base tables, hysteresis filter and effects fitted together on whole records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, hysteresis
from mrctl.identify.layout import Layout, Tables
from mrctl.identify.noise import correlation_inflation, record_noise
from mrctl.identify.penalties import Penalty, base_penalties
from mrctl.identify.records import Record
from mrctl.identify.solver import Normal, Solution, covariance, solve

Array = NDArray[np.float64]

WEIGHING_RATE_HZ = 500.0  # forces are compared at this rate or up to twice it; dampers do little above 100 Hz
SETTLE_TIMES = 4.0  # slowest time constants that a record's start is left out for
SETTLE_SHARE = 0.1  # but never more than this share of it
REST_SHARE = 0.03  # a record that starts slower than this share of its top speed starts at rest
FLOOR_SHARE = 1e-5  # of the force scale: noise below this is no noise


@dataclass
class JointModel:
    """Records under one layout; everything the fit, the covariance and the diagnosis ask of them."""

    layout: Layout
    records: Sequence[Record]
    inputs: list[base.Inputs] = field(init=False)
    weights: Array = field(init=False)
    noise_n: Array = field(init=False)

    def __post_init__(self) -> None:
        self.inputs = [
            base.Inputs.of(self.layout, r.rate_hz, r.velocity_m_s, r.current_a, r.temperature_c)
            for r in self.records
        ]
        self.noise_n = np.full(len(self.records), 0.05 * self.layout.force_scale_n)
        self.weights = 1.0 / self.noise_n**2

    @property
    def size(self) -> int:
        """How many parameters there are."""
        return self.layout.size

    def factor(self, record: Record) -> int:
        """Samples of a record that are averaged before they are weighed."""
        return max(1, int(record.rate_hz / WEIGHING_RATE_HZ))

    def settle_blocks(self, theta: Array, record: Record) -> int:
        """Averages at the start of a record that its unknown past may still move."""
        velocity = np.abs(record.velocity_m_s)
        if velocity[0] < REST_SHARE * velocity.max():
            return 0  # it starts at rest, so its past is known
        slow = hysteresis.slowest_s(theta[self.layout.parts["filter"]])
        samples = min(SETTLE_TIMES * slow * record.rate_hz, SETTLE_SHARE * len(record))
        return int(samples / self.factor(record))

    def predict(self, theta: Array) -> list[Array]:
        """Force in N of each record."""
        tables = self.layout.unpack(theta)
        return [base.force(x, tables) for x in self.inputs]

    def residuals(self, theta: Array) -> list[Array]:
        """Measured less predicted force in N at the weighing rate, a start of unknown past left out."""
        return [
            base.averaged(r.force_n - y, self.factor(r))[self.settle_blocks(theta, r) :]
            for r, y in zip(self.records, self.predict(theta), strict=True)
        ]

    def cost(self, theta: Array) -> float:
        """Half the weighted square sum."""
        return 0.5 * float(
            sum(w * float(r @ r) for w, r in zip(self.weights, self.residuals(theta), strict=True))
        )

    def normal(self, theta: Array) -> Normal:
        """Weighted normal equations, record by record."""
        tables = self.layout.unpack(theta)
        matrix, right, cost = np.zeros((self.size, self.size)), np.zeros(self.size), 0.0
        for record, inputs, weight in zip(self.records, self.inputs, self.weights, strict=True):
            factor = self.factor(record)
            line = base.linearise(inputs, self.layout, tables, factor)
            skip = self.settle_blocks(theta, record)
            rest = base.averaged(record.force_n - line.force_n, factor)[skip:]
            rows = line.jacobian[:, skip:]
            matrix[np.ix_(line.index, line.index)] += weight * (rows @ rows.T)
            right[line.index] += weight * (rows @ rest)
            cost += 0.5 * weight * float(rest @ rest)
        return Normal(matrix, right, cost)

    def bounds(self, *, minimum_phase: bool = False) -> tuple[Array, Array]:
        """Bounds of each parameter: f rises, g has the velocity's sign, poles are within reach."""
        layout, parts = self.layout, self.layout.parts
        lower, upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        steps = np.diff(layout.current_a, prepend=layout.current_a[0] - 1.0)
        lower[parts["f"]] = 1e-4 * steps
        sign = np.sign(layout.velocity_m_s[layout.free_g])
        at = np.arange(parts["g"].start, parts["g"].stop)
        lower[at[sign > 0]], upper[at[sign < 0]] = 1e-6, -1e-6
        for name in ("h_on", "h_off"):
            lower[parts[name]], upper[parts[name]] = np.log(0.05), np.log(20.0)
        if layout.free_blend:
            low, high = float(layout.current_a[0]), float(layout.current_a[-1])
            lower[parts["blend"]], upper[parts["blend"]] = low, high
        order = layout.order
        top = 0.8 * max(r.rate_hz for r in self.records) * np.pi / hysteresis.UNIT_RAD_S
        bottom = 0.02  # 0.2 Hz
        poles = np.arange(parts["filter"].start, parts["filter"].start + order)
        lower[poles], upper[poles] = np.log(bottom), np.log(top)
        if order >= 2:
            lower[poles[-1]], upper[poles[-1]] = 2 * np.log(bottom), 2 * np.log(top)
            upper[poles[-2]] = np.log(2 * top)
        if minimum_phase:
            lower[parts["filter"].stop - order : parts["filter"].stop] = 0.0
        return lower, upper

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

    def fit(
        self,
        theta: Array,
        *,
        penalties: list[Penalty] | None = None,
        free: NDArray[np.bool_] | None = None,
        rounds: int = 4,
        iterations: int = 8,
        tolerance: float = 0.0,
        minimum_phase: bool = False,
    ) -> JointFit:
        """Rounds of fit, then evidence for the penalties' and the records' weights."""
        penalties = base_penalties(self.layout, neutral(self.layout)) if penalties is None else penalties
        lower, upper = self.bounds(minimum_phase=minimum_phase)
        solution = None
        for number in range(rounds):
            if number:
                self.reweigh(theta, each=True)
            solution = solve(
                self.normal,
                self.cost,
                theta,
                lower,
                upper,
                penalties,
                free=free,
                iterations=iterations,
                tolerance=max(0.1 if number == rounds - 1 else 0.5, tolerance * self.cost(theta)),
            )
            theta = solution.theta
            if number < rounds - 1:
                spread = covariance(solution.normal, penalties, solution.held)
                penalties = [p.reweighed(theta, spread) for p in penalties]
        if solution is None:
            raise ValueError("a fit takes at least one round")
        return JointFit(self, solution, penalties)


@dataclass
class JointFit:
    """A fitted joint model."""

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
        return self.model.layout.unpack(self.theta)


def neutral(layout: Layout) -> Array:
    """What the parameters are taken to be where nothing is measured: h = 1, H = a lag at 30 Hz."""
    knots = layout.velocity_m_s
    top = abs(knots[layout.gauge])
    g = np.tanh(knots / (0.25 * top)) / np.tanh(1.0 / 0.25)
    g = g * np.sign(knots[layout.gauge])
    count = layout.current_a.size
    f = np.linspace(0.3, 1.0, count) * layout.force_scale_n if count > 1 else np.array([layout.force_scale_n])
    ones = np.ones(layout.temperature_c.size)
    return layout.pack(
        Tables(f, g, ones, ones.copy(), layout.off_below_a, layout.on_above_a, neutral_filter(layout.order))
    )


def neutral_filter(order: int) -> Array:
    """Poles around 30 Hz, numerator halfway between a pure lag and none."""
    p = np.log(3.0)
    poles = {0: [], 1: [p], 2: [p + np.log(2.0), 2 * p], 3: [p, p + np.log(2.0), 2 * p]}[order]
    return np.array([*poles, *([0.3] * order)])
