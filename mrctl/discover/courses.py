"""Courses that a force has for reasons of no effect in the library: what is left is held against each.

A force may fade as the damper works, its knee may lie elsewhere at another current, the stiffness of a rubber
may relax. None of these can be named and put into a calibration, but where one of them takes what a model
leaves, something is missing that is not in the model; and which one does so is where to look for it. Each is
a few columns of force; how much of the residual they take is known once the model, effects and all, may move
beside them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.signal import lfilter

from mrctl.discover.proof import Proof, chance
from mrctl.discover.tangent import Tangent
from mrctl.discover.worth import LEAST_SCORE, SIGNIFICANCE
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.parallel import in_parallel
from mrctl.identify.records import Record

Array = NDArray[np.float64]
Column = list[Array]  # a force's course in each record, every sample

FADING = (0.03, 0.1, 0.3, 1.0)  # of all there is: how soon a force has faded
MOMENTS_S = (0.1, 0.3, 1.0, 3.0)  # over which a mean speed is taken
RELAXING_S = (0.01, 0.05, 0.25)  # of a rubber's elements
SHORT_S = 0.01  # over which an acceleration or a current's rate is taken
SMALL = 0.01  # a step of a knee, relative, at the largest current
SAME = 1e-6  # of a column's square: less of it is beyond the model, and it is the model's own


@dataclass(frozen=True, slots=True)
class Course:
    """What one course takes of the mean square that a model leaves, and whether that is no chance."""

    words: str  # what a force of that course does
    share: float
    score: float  # twice the log-likelihood ratio less what its parameters must earn (BIC)
    chance: float  # that a course without meaning takes as much, of all
    alike: frozenset[str]  # effects that it may be another form of

    @property
    def certain(self) -> bool:
        """Whether something of that course is left."""
        return self.chance < SIGNIFICANCE and self.score > LEAST_SCORE


@dataclass(frozen=True, eq=False)
class _Signals:
    """What the courses are made of."""

    fit: JointFit
    records: Sequence[Record]
    forces: Column

    def each(self, make: Callable[..., Array], *more: float) -> Column:
        """What is made of each record and the model's force there (n), in N."""
        return [make(r, f, *more) for r, f in zip(self.records, self.forces, strict=True)]


@dataclass(frozen=True)
class _Kind:
    """A course in words, the sets of columns that it may have, and effects it may be another form of."""

    words: str
    make: Callable[[_Signals], Iterator[list[Column]]]
    alike: tuple[str, ...] = ()
    low: float = -np.inf  # of a column's size: a rubber's stiffness is not negative


def courses_of(proof: Proof) -> list[Course]:
    """What each course takes of what a model leaves, the model settling beside it; most first."""
    fit = proof.fit
    tangent = Tangent.of(fit)
    signals = _Signals(fit, fit.model.records, fit.model.predict(fit.theta))
    whole, samples = float(tangent.residual @ tangent.residual), proof.independent
    if whole <= 0.0:
        return []

    def judged(kind: _Kind) -> Course:
        found = [(_taken(tangent, columns, kind.low) / whole, len(columns)) for columns in kind.make(signals)]
        share, columns = max(found, default=(0.0, 1))
        parameters = columns + (len(found) > 1)
        gain = -samples * float(np.log1p(-min(share, 1.0 - 1e-12)))
        score = gain - parameters * float(np.log(samples))
        by_chance = min(1.0, chance(gain, parameters) * len(KINDS))
        return Course(kind.words, share, score, by_chance, frozenset(kind.alike))

    return sorted(in_parallel(judged, KINDS), key=lambda c: -c.share)


def _taken(tangent: Tangent, columns: Sequence[Column], low: float) -> float:
    """What columns of force, of sizes from `low` up, take off the weighed square sum."""
    rows = np.array([tangent.stacked(column) for column in columns])
    size = np.sqrt(np.sum(rows**2, axis=1))
    beyond = tangent.beyond(rows / np.maximum(size, 1e-300)[:, None])
    beyond = beyond[np.sum(beyond**2, axis=1) > SAME]
    if not beyond.size:
        return 0.0
    axes, spread, _ = np.linalg.svd(beyond @ beyond.T)
    root = axes * np.sqrt(np.maximum(spread, SAME * spread[0]))  # root root' is the columns' gram
    target = np.linalg.solve(root, beyond @ tangent.residual)
    return float(target @ target - 2.0 * lsq_linear(root.T, target, (low, np.inf)).cost)


def _fading(s: _Signals, driver: Callable[[Record, Array], Array]) -> Iterator[list[Column]]:
    """A force that fades, or recovers, as something of each run adds up."""
    done = s.each(lambda r, f: np.cumsum(driver(r, f)) / r.rate_hz)
    most = max(float(d[-1]) for d in done)
    for share in FADING:
        if most > 0.0:
            yield [[f * np.exp(-d / (share * most)) for f, d in zip(s.forces, done, strict=True)]]


def _after_speed(s: _Signals) -> Iterator[list[Column]]:
    """A fluid that thins by the mean speed of the last moments."""
    for moment in MOMENTS_S:
        yield [s.each(lambda r, f, t: f * _lagged(np.abs(r.velocity_m_s), t * r.rate_hz), moment)]


def _after_current(s: _Signals) -> Iterator[list[Column]]:
    """A coil or a fluid that remembers the current for longer than a lag does."""
    for moment in MOMENTS_S:
        yield [s.each(lambda r, f, t: f * _lagged(r.current_a, t * r.rate_hz), moment)]


def _over_campaign(s: _Signals) -> Iterator[list[Column]]:
    """A damper that ages, or settles, from run to run in their order."""
    yield [s.each(lambda r, f: f * r.run)]


def _each_way(s: _Signals) -> Iterator[list[Column]]:
    """Damping that hangs on where the piston is, otherwise in rebound than in compression."""
    most = max(float(np.max(np.abs(r.displacement_m))) for r in s.records)
    if most > 0.0:
        yield [s.each(lambda r, f, p: np.abs(f) * (r.displacement_m / most) ** p, power) for power in (1, 2)]


def _with_acceleration(s: _Signals) -> Iterator[list[Column]]:
    yield [s.each(lambda r, f: f * np.abs(_lagged(r.acceleration_m_s2, SHORT_S * r.rate_hz)))]


def _knee(s: _Signals, level: Callable[[Record], Array]) -> Iterator[list[Column]]:
    """A g that belongs to another speed where the level is another."""
    model, theta = s.fit.model, s.fit.theta
    most = max(float(np.max(np.abs(level(r)))) for r in s.records)
    if most > 0.0:
        moved = [_faster(r, 1.0 + SMALL * level(r) / most) for r in s.records]
        there = model.on(moved).predict(theta)
        yield [[(a - b) / SMALL for a, b in zip(there, s.forces, strict=True)]]


def _slower_filter(s: _Signals, level: Callable[[Record], Array]) -> Iterator[list[Column]]:
    """A hysteresis that lasts longer where the level is another."""
    yield [s.each(lambda r, f: np.gradient(f) * r.rate_hz * level(r))]


def _stiffness(s: _Signals, level: Callable[[Record], Array]) -> Iterator[list[Column]]:
    yield [s.each(lambda r, _: r.displacement_m * level(r))]


def _by_place(s: _Signals) -> Iterator[list[Column]]:
    """A friction or a damping beside the fluid's that hangs on where the piston is."""
    for power in (0.0, 0.5, 1.0):
        yield [
            s.each(lambda r, _, p: _signed(r, p) * r.displacement_m, power),
            s.each(lambda r, _, p: _signed(r, p) * np.abs(r.displacement_m), power),
        ]


def _relaxing(s: _Signals) -> Iterator[list[Column]]:
    """A rubber beside the damper, whose stiffness relaxes."""
    yield [
        s.each(lambda r, _, t: r.displacement_m - _lagged(r.displacement_m, t * r.rate_hz), time_s)
        for time_s in RELAXING_S
    ]


def _bent_cell(s: _Signals) -> Iterator[list[Column]]:
    """A force that is told too large or too small where it is large."""
    most = max(float(np.max(np.abs(f))) for f in s.forces)
    if most > 0.0:
        yield [s.each(lambda _, f, p: f * (f / most) ** p, power) for power in (1, 2)]


def _current(r: Record) -> Array:
    return r.current_a


def _warmth(r: Record) -> Array:
    return r.temperature_c - 25.0


_RUN, _PATH, _ENERGY = (
    partial(_fading, driver=driver)
    for driver in (
        lambda r, _: np.ones(len(r)),
        lambda r, _: np.abs(r.velocity_m_s),
        lambda r, f: np.maximum(f * r.velocity_m_s, 0.0),
    )
)

KINDS = (
    _Kind("fades or grows in the course of a run", _RUN),
    _Kind("fades or grows with the path travelled", _PATH),
    _Kind("fades or grows with the energy put in", _ENERGY, ("self_heating",)),
    _Kind("hangs on the mean speed of the last moments", _after_speed),
    _Kind(
        "hangs on the mean current of the last moments",
        _after_current,
        ("current_lag", "magnetic_hysteresis"),
    ),
    _Kind("grows or fades from run to run", _over_campaign),
    _Kind("hangs on the size of the acceleration", _with_acceleration),
    _Kind(
        "has its knee at another speed where the current is another",
        partial(_knee, level=_current),
        ("mount_compliance", "off_state_backbone"),
    ),
    _Kind("has its knee at another speed where it is warmer", partial(_knee, level=_warmth)),
    _Kind(
        "follows faster or slower where the current is another",
        partial(_slower_filter, level=_current),
        ("mount_compliance", "preyield_stiffness"),
    ),
    _Kind("follows faster or slower where it is warmer", partial(_slower_filter, level=_warmth)),
    _Kind("has a stiffness that hangs on the current", partial(_stiffness, level=_current)),
    _Kind(
        "has a stiffness that hangs on the temperature", partial(_stiffness, level=_warmth), ("gas_spring",)
    ),
    _Kind("has a friction or damping that hangs on the stroke", _by_place, ("stroke_dependent_damping",)),
    _Kind("hangs on the stroke otherwise in rebound than in compression", _each_way),
    _Kind("has a stiffness that relaxes", _relaxing, low=0.0),
    _Kind("is told too large or too small where it is large", _bent_cell, ("rebound_asymmetry",)),
)


def _signed(r: Record, power: float) -> Array:
    """The speed to a power, with the velocity's sign; at the power 0 soft about standstill."""
    v = r.velocity_m_s
    if power == 0.0:
        return np.tanh(v / max(0.02 * float(np.abs(v).max()), 1e-9))
    return np.sign(v) * np.abs(v) ** power


def _faster(r: Record, times: Array) -> Record:
    return replace(r, velocity_m_s=r.velocity_m_s * times)


def _lagged(x: Array, samples: float) -> Array:
    """A first-order lag of so many samples, settled at the first one."""
    keep = float(np.exp(-1.0 / max(samples, 1e-9)))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0], dtype=np.float64)
