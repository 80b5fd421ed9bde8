"""Bouc-Wen models, plain and Spencer's, fitted to records: least squares on the integrated equations.

What enters is normalised, so that no two parameters do the same: with z0 = (A / (gamma + beta))^(1/n), the
yield force alpha z0, the sharpness A / z0 and the unloading share gamma / (gamma + beta) say all that
alpha, gamma, beta and A can. The published relations are linear in the drive; a drive that saturates,
i_s (1 - exp(-i / i_s)), stands in for the current, without which no strong current would fit. Temperature is
not part of these models. Each run counts by its error over its largest force, which is what is reported.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from mrctl.identify.baselines.result import Array, Model, Quantity
from mrctl.identify.best import few
from mrctl.identify.records import Record
from mrctl.measurements.run import Run
from mrctl.model.baselines.bouc_wen import BoucWen
from mrctl.plant.spencer import simulate_bouc_wen

RATE_HZ = 500.0
SECONDS = 3.0  # of each record
SETTLE_S = 0.3  # from an unknown past
TOLERANCE = 1e-6  # of the integration while fitting
SLOPE_STEP = 1e-4
ROUGH, FINE, FINAL = 8, 40, 15  # evaluations of the slopes
LOST = 10.0  # the miss of a trial whose state flew away, in largest forces
FAST_1_S = 1e5  # a lag that is none
VARYING_A = 0.05  # a current that changes by more within a run shows the lag


@dataclass(frozen=True, slots=True)
class Free:
    """A free parameter: its unit, bounds and a first guess, in the unit; `log`: fitted as a logarithm."""

    name: str
    unit: str
    low: float
    high: float
    guess: float
    log: bool = False

    def inner(self, value: float) -> float:
        """The value as the optimiser has it: near 1 where it matters."""
        return math.log(value) if self.log else value / self.scale

    def outer(self, inner: float) -> float:
        """The value in its unit."""
        return math.exp(inner) if self.log else inner * self.scale

    @property
    def scale(self) -> float:
        """What counts as much."""
        return max(abs(self.guess), 1e-3 * (self.high - self.low))


def fit_bouc_wen(records: Sequence[Record]) -> Model:
    """The plain model: F = alpha z + c0 v + k (x - x0)."""
    return _fit(records, _common(records))


def fit_spencer(records: Sequence[Record]) -> Model:
    """Spencer's modified model, with a dashpot c1 in series and a spring k1 beside."""
    force, speed, stroke = _sizes(records)
    c, k = force / speed, force / stroke
    drive = _largest_drive(records)
    series = [
        Free("c1_a", "N*s/m", 1.0 * c, 1e4 * c, 20.0 * c, log=True),
        Free("c1_b", "N*s/m/A", 0.0, 100.0 * c / drive, 5.0 * c / drive),
        Free("k0", "N/m", 0.0, 3.0 * k, 0.05 * k),
    ]
    return _fit(records, _common(records) + series)


def _common(records: Sequence[Record]) -> list[Free]:
    force, speed, stroke = _sizes(records)
    c, k, drive = force / speed, force / stroke, _largest_drive(records)
    free = [
        Free("c0_a", "N*s/m", 0.0, 2.0 * c, 0.15 * c),
        Free("c0_b", "N*s/m/A", 0.0, 2.0 * c / drive, 0.1 * c / drive),
        Free("yield_a", "N", 0.0, force, 0.1 * force),
        Free("yield_b", "N/A", 0.0, 5.0 * force / drive, 0.7 * force / drive),
        Free("sharpness", "1/m", 1.0 / stroke, 3e3 / stroke, 20.0 / stroke, log=True),
        Free("unloading_share", "1", 0.5, 5.0, 0.6),  # below 1/2 it would give energy
        Free("n", "1", 1.0, 6.0, 1.5),
        Free("k1", "N/m", 0.0, k, 0.02 * k),
        Free("offset", "N", -0.5 * force, 0.5 * force, -0.01 * force),
        Free("saturation", "A", 0.2 * drive, 50.0 * drive, 1.5 * drive, log=True),
    ]
    if any(float(np.ptp(r.current_a)) > VARYING_A for r in records):
        free.append(Free("eta", "1/s", 5.0, 2000.0, 100.0, log=True))
    return free


def _sizes(records: Sequence[Record]) -> tuple[float, float, float]:
    """Force in N, speed in m/s, stroke in m."""
    names = ("force_n", "velocity_m_s", "displacement_m")
    force, speed, stroke = (max(float(np.max(np.abs(getattr(r, n)))) for r in records) for n in names)
    return force, speed, stroke


def _largest_drive(records: Sequence[Record]) -> float:
    return max(0.1, *(float(r.current_a.max()) for r in records))


def _model(values: dict[str, float]) -> BoucWen:
    """The equations' parameters. A is set to 1, which only fixes the unit of z."""
    z0 = 1.0 / values["sharpness"]
    both = z0 ** -values["n"]
    k1 = max(values["k1"], 1e-3)
    return BoucWen(
        values["c0_a"], values["c0_b"], values.get("k0", 0.0), values.get("c1_a", math.inf),
        values.get("c1_b", 0.0), k1, -values["offset"] / k1, values["yield_a"] / z0, values["yield_b"] / z0,
        values["unloading_share"] * both, (1.0 - values["unloading_share"]) * both, 1.0, values["n"],
        values.get("eta", FAST_1_S),
    )  # fmt: skip


def _drive(current_a: Array, saturation_a: float) -> Array:
    return np.asarray(-saturation_a * np.expm1(-np.maximum(current_a, 0.0) / saturation_a), dtype=np.float64)


def _simulated(values: dict[str, float], record: Record | Run, rate_hz: float, relative: float) -> Array:
    drive = _drive(record.current_a, values["saturation"])
    return simulate_bouc_wen(
        _model(values), rate_hz, record.displacement_m, record.velocity_m_s, drive, relative=relative
    )


def _fit(records: Sequence[Record], free: list[Free]) -> Model:
    """From several guesses on a few runs, then from the best on all."""
    lower, upper = (np.array([_end(p, bound) for p in free], dtype=np.float64) for bound in ("low", "high"))

    def named(inner: Array) -> dict[str, float]:
        return {p.name: p.outer(float(x)) for p, x in zip(free, inner, strict=True)}

    def misses(inner: Array, shown: Sequence[Record]) -> Array:
        values = named(inner)
        return np.concatenate([_miss(values, r) for r in shown])

    def fit(start: Array, shown: Sequence[Record], evaluations: int) -> OptimizeResult:
        return least_squares(
            misses, start, bounds=(lower, upper), x_scale="jac", diff_step=SLOPE_STEP, max_nfev=evaluations,
            ftol=1e-5, xtol=1e-6, args=(shown,),
        )  # fmt: skip

    every = [_shortened(r) for r in records]
    some = [_shortened(r) for r in few(records)]
    starts = [np.clip(s, lower + 1e-9, upper - 1e-9) for s in _starts(free)]
    rough = min((fit(start, some, ROUGH) for start in starts), key=lambda one: float(one.cost))
    better = fit(rough.x, some, FINE)
    values = named((fit(better.x, every, FINAL) if len(every) > len(some) else better).x)

    def predict(run: Run) -> Array:
        return _simulated(values, run, run.sample_rate_hz, TOLERANCE)

    units = {p.name: p.unit for p in free}
    return Model({name: Quantity(value, units[name]) for name, value in values.items()}, predict)


def _miss(values: dict[str, float], record: Record) -> Array:
    settled = slice(round(SETTLE_S * record.rate_hz), None)
    miss = (_simulated(values, record, record.rate_hz, TOLERANCE) - record.force_n)[settled]
    miss = np.where(np.isfinite(miss), miss / float(np.max(np.abs(record.force_n))), LOST)
    return np.asarray(miss, dtype=np.float64)


def _end(p: Free, bound: str) -> float:
    return p.inner(float(getattr(p, bound)))


def _shortened(record: Record) -> Record:
    """The record's first seconds at the fitting rate."""
    coarse = record.decimated(max(1, round(record.rate_hz / RATE_HZ)))
    n = min(len(coarse), round(SECONDS * coarse.rate_hz))
    return Record(
        coarse.run, coarse.rate_hz, coarse.velocity_m_s[:n], coarse.current_a[:n], coarse.temperature_c[:n],
        coarse.force_n[:n], coarse.displacement_m[:n], coarse.acceleration_m_s2[:n],
    )  # fmt: skip


def _starts(free: list[Free]) -> list[Array]:
    """First guesses: smooth or sharp yielding, a soft or stiff dashpot."""
    starts = []
    for sharper, stiffer in ((1.0, 1.0), (20.0, 0.3), (5.0, 10.0)):
        by = {"sharpness": sharper, "c1_a": stiffer}
        starts.append(np.array([p.inner(p.guess * by.get(p.name, 1.0)) for p in free]))
    return starts
