"""What physics outside the library does to a force: the columns of force that each kind of it would add."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.evidence import MOVED_M
from mrctl.discover.fits.signals import turned_m
from mrctl.identify.filtering import filtered
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record

Array = NDArray[np.float64]
Column = list[Array]  # a force's course in each record, every sample
Level = Callable[[Record], Array]

FADING = (0.03, 0.1, 0.3, 1.0)  # of all there is: how soon a force has faded
MOMENTS_S = (0.1, 0.3, 1.0, 3.0)  # over which a mean speed is taken
REBUILT_S, BROKEN_M = (1.0, 3.0, 10.0, 30.0), (0.1, 0.3, 1.0)  # of a fluid's structure: time at rest, way
REBUILDS = 0.5  # of the longest record: what takes longer is broken down by the way alone
GRAIN_S = 0.02  # over which that hardly changes
RELAXING_S = (0.01, 0.05, 0.25)  # of a rubber's elements
SHORT_S = 0.01  # over which an acceleration is taken
TURNED_M = (1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3, 3.2e-3)  # ways from a turn to where a force is nearly back, ...
PLACES = (0.0, 0.5, 1.0, 2.0)  # ... and where along them it is asked for: at the last it is back
SMALL = 0.01  # of the velocity, a step to see what a knee at another speed would change
LEAST_A, LEAST_K = 0.1, 2.0  # that current and temperature must change by, for anything to hang on them


@dataclass(frozen=True, eq=False)
class Signals:
    """What the courses are made of."""

    fit: JointFit
    records: Sequence[Record]
    forces: Column

    def each(self, make: Callable[..., Array], *more: float) -> Column:
        """What is made of each record and the model's force there (n), in N."""
        return [make(r, f, *more) for r, f in zip(self.records, self.forces, strict=True)]

    def change(self, level: Level) -> float:
        """How far a level goes in all records together."""
        return max(float(level(r).max()) for r in self.records) - min(
            float(level(r).min()) for r in self.records
        )

    def centred(self, level: Level) -> Column:
        """A level from its mean, over its largest distance from there: -1 to 1."""
        mean = float(np.mean(np.concatenate([level(r) for r in self.records])))
        most = max(float(np.max(np.abs(level(r) - mean))) for r in self.records)
        return [(level(r) - mean) / max(most, 1e-300) for r in self.records]

    def faster(self, share: Column) -> Column:
        """How the model's force would change, in N, by motions that are faster by that share."""
        moved = [
            replace(r, velocity_m_s=r.velocity_m_s * (1.0 + SMALL * x))
            for r, x in zip(self.records, share, strict=True)
        ]
        there = self.fit.model.on(moved).predict(self.fit.theta)
        return [(a - b) / SMALL for a, b in zip(there, self.forces, strict=True)]

    @property
    def moves(self) -> bool:
        """Whether there is a stroke."""
        return any(float(np.ptp(r.displacement_m)) > MOVED_M for r in self.records)


def product(one: Column, other: Column) -> Column:
    """Of two columns, sample by sample."""
    return [a * b for a, b in zip(one, other, strict=True)]


@dataclass(frozen=True, eq=False)
class Columns:
    """A course's columns of force, and those beside it that are something else's: no credit for these."""

    own: list[Column]
    beside: list[Column] = field(default_factory=list)


@dataclass(frozen=True)
class Kind:
    """A course in words, the columns that it may have, and effects that it may be another form of."""

    words: str
    measure: str
    make: Callable[[Signals], Iterator[Columns]]
    alike: tuple[str, ...] = ()
    low: float = -np.inf  # of a column's size: a rubber's stiffness is not negative


def _fading(s: Signals, driver: Callable[[Record, Array], Array]) -> Iterator[Columns]:
    """A force that fades, or recovers, as something of each run adds up."""
    done = s.each(lambda r, f: np.cumsum(driver(r, f)) / r.rate_hz)
    most = max(float(d[-1]) for d in done)
    for share in FADING:
        if most > 0.0:
            yield Columns([[f * np.exp(-d / (share * most)) for f, d in zip(s.forces, done, strict=True)]])


def _after_speed(s: Signals) -> Iterator[Columns]:
    """A fluid that thins by the mean speed of the last moments."""
    for moment in MOMENTS_S:
        yield Columns([s.each(lambda r, f, t: f * _lagged(np.abs(r.velocity_m_s), t * r.rate_hz), moment)])


def _rested(s: Signals) -> Iterator[Columns]:
    """A fluid whose structure motion breaks and time rebuilds (Moore, Trans. Brit. Ceram. Soc. 58 (1959))."""
    longest_s = max(len(r) / r.rate_hz for r in s.records)
    for rebuilt_s in (t for t in REBUILT_S if t < REBUILDS * longest_s):
        for broken_m in BROKEN_M:
            whole = s.each(lambda r, _, *of: _structure(r, *of), rebuilt_s, broken_m)
            yield Columns([product(s.forces, whole)])


def _after_current(s: Signals) -> Iterator[Columns]:
    """A coil or a fluid that remembers the current for longer than a lag does."""
    if s.change(_current) > LEAST_A:
        for moment in MOMENTS_S:
            yield Columns([s.each(lambda r, f, t: f * _lagged(r.current_a, t * r.rate_hz), moment)])


def _with_acceleration(s: Signals) -> Iterator[Columns]:
    yield Columns([s.each(lambda r, f: f * np.abs(_lagged(r.acceleration_m_s2, SHORT_S * r.rate_hz)))])


def _knee(s: Signals, level: Level, least: float) -> Iterator[Columns]:
    """A g that belongs to another speed where the level is another."""
    if s.change(level) > least:
        yield Columns([s.faster(s.centred(level))], [s.faster(s.each(lambda r, _: np.ones(len(r))))])


def _slower_filter(s: Signals, level: Level, least: float) -> Iterator[Columns]:
    """A hysteresis that lasts longer where the level is another."""
    if s.change(level) > least:
        rate = s.each(lambda r, f: np.gradient(f) * r.rate_hz)
        yield Columns([product(rate, s.centred(level))], [rate])


def _stiffness(s: Signals, level: Level, least: float) -> Iterator[Columns]:
    """A spring beside the damper that is stiffer where the level is another."""
    if s.change(level) > least and s.moves:
        stroke, height = s.centred(_stroke), s.centred(level)
        yield Columns([product(stroke, height)], [stroke, height])


def _by_place(s: Signals) -> Iterator[Columns]:
    """A friction or a damping beside the fluid's that hangs on where the piston is."""
    if not s.moves:
        return
    stroke = s.centred(_stroke)
    for power in (0.0, 0.5, 1.0):
        signed = s.each(lambda r, _, p: _signed(r, p), power)
        yield Columns([product(signed, stroke), product(signed, [np.abs(x) for x in stroke])], [signed])


def _each_way(s: Signals) -> Iterator[Columns]:
    """Damping that hangs on where the piston is, otherwise in rebound than in compression."""
    if s.moves:
        stroke, size = s.centred(_stroke), [np.abs(f) for f in s.forces]
        own = product(size, stroke)
        yield Columns([own, product(own, stroke)], [size])


def _after_turning(s: Signals) -> Iterator[Columns]:
    """Play, or what stretches: another force up to some way from where the motion turned."""
    if s.moves:
        ways = [np.abs(turned_m(r)) for r in s.records]
        for reach in TURNED_M:
            yield Columns([product(s.forces, [_hat(w / reach, place) for w in ways]) for place in range(3)])


def _relaxing(s: Signals) -> Iterator[Columns]:
    """A rubber beside the damper, whose stiffness relaxes."""
    if s.moves:
        yield Columns(
            [
                s.each(lambda r, _, t: r.displacement_m - _lagged(r.displacement_m, t * r.rate_hz), time_s)
                for time_s in RELAXING_S
            ]
        )


def _bent_cell(s: Signals) -> Iterator[Columns]:
    """A force that is told too large or too small where it is large."""
    most = max(float(np.max(np.abs(f))) for f in s.forces)
    if most > 0.0:
        yield Columns([s.each(lambda _, f, p: f * (f / most) ** p, power) for power in (1, 2)])


def _current(r: Record) -> Array:
    return r.current_a


def _warmth(r: Record) -> Array:
    return r.temperature_c


def _stroke(r: Record) -> Array:
    return r.displacement_m


_RUN, _PATH, _ENERGY = (
    partial(_fading, driver=driver)
    for driver in (
        lambda r, _: np.ones(len(r)),
        lambda r, _: np.abs(r.velocity_m_s),
        lambda r, f: np.maximum(f * r.velocity_m_s, 0.0),
    )
)

_LONG = "one sine at one current for a minute or more, and the same after a rest"
_ABOUT_KNEE = "a slow triangle through the knee at each {}, the rest as it was"
_FAST = "a fast sine at each {}, the rest as it was"
_PLACES = "slow strokes of one length about different middles, one current"

KINDS = (
    Kind("fades or grows in the course of a run", _LONG, _RUN),
    Kind("fades or grows with the path travelled", _LONG, _PATH),
    Kind("fades or grows with the energy put in", _LONG, _ENERGY, ("self_heating",)),
    Kind(
        "hangs on the mean speed of the last moments",
        "a slow sine right after a fast one, and by itself, one current",
        _after_speed,
    ),
    Kind(
        "is higher after a rest, until the motion has broken that down",
        "the same sine after a rest of a second, of ten and of a minute, one current",
        _rested,
    ),
    Kind(
        "hangs on the mean current of the last moments",
        "a sine right after a minute at full current, and after one at none",
        _after_current,
        ("current_lag", "magnetic_hysteresis"),
    ),
    Kind(
        "hangs on the size of the acceleration",
        "two sines of one largest speed, a short fast one and a long slow one",
        _with_acceleration,
    ),
    Kind(
        "has its knee at another speed where the current is another",
        _ABOUT_KNEE.format("current"),
        partial(_knee, level=_current, least=LEAST_A),
        ("mount_compliance", "off_state_backbone"),
    ),
    Kind(
        "has its knee at another speed where it is warmer",
        _ABOUT_KNEE.format("temperature"),
        partial(_knee, level=_warmth, least=LEAST_K),
    ),
    Kind(
        "follows faster or slower where the current is another",
        _FAST.format("current"),
        partial(_slower_filter, level=_current, least=LEAST_A),
        ("mount_compliance", "preyield_stiffness"),
    ),
    Kind(
        "follows faster or slower where it is warmer",
        _FAST.format("temperature"),
        partial(_slower_filter, level=_warmth, least=LEAST_K),
    ),
    Kind(
        "has a stiffness that hangs on the current",
        "the whole stroke, slowly, at each current",
        partial(_stiffness, level=_current, least=LEAST_A),
    ),
    Kind(
        "has a stiffness that hangs on the temperature",
        "the whole stroke, slowly, at each temperature",
        partial(_stiffness, level=_warmth, least=LEAST_K),
        ("gas_spring",),
    ),
    Kind(
        "has a friction or damping that hangs on the stroke",
        _PLACES,
        _by_place,
        ("stroke_dependent_damping",),
    ),
    Kind("hangs on the stroke otherwise in rebound than in compression", _PLACES, _each_way),
    Kind(
        "hangs on the way since the motion turned",
        "a slow triangle of a few millimetres, one current",
        _after_turning,
        ("preyield_stiffness", "coulomb_friction", "mount_compliance", "sensor_delay"),
    ),
    Kind("has a stiffness that relaxes", "a step of the stroke, held for ten seconds", _relaxing, low=0.0),
    Kind(
        "is told too large or too small where it is large",
        "known weights on the load cell",
        _bent_cell,
        ("rebound_asymmetry",),
    ),
)


def _signed(r: Record, power: float) -> Array:
    """The speed to a power, with the velocity's sign; at the power 0 soft about standstill."""
    v = r.velocity_m_s
    if power == 0.0:
        return np.tanh(v / max(0.02 * float(np.abs(v).max()), 1e-9))
    return np.sign(v) * np.abs(v) ** power


def _hat(way: Array, place: int) -> Array:
    """1 at one of the places on a way, straight to 0 at those beside it."""
    return np.asarray(np.interp(way, PLACES, np.eye(len(PLACES))[place]))


def _structure(record: Record, rebuilt_s: float, broken_m: float) -> Array:
    """What a record has of a structure, whole at first, that way breaks down and time rebuilds: 0 to 1."""
    size = max(1, round(GRAIN_S * record.rate_hz))
    speed = np.add.reduceat(np.abs(record.velocity_m_s), np.arange(0, len(record), size)) / size
    rate = 1.0 / rebuilt_s + speed / broken_m
    kept, settled = np.exp(-rate * size / record.rate_hz), 1.0 / (rebuilt_s * rate)
    level, found = 1.0, [1.0]
    for keep, end in zip(kept.tolist(), settled.tolist(), strict=True):
        level = end + (level - end) * keep
        found.append(level)
    return np.interp(np.arange(len(record)), size * np.arange(len(found)), found)


def _lagged(x: Array, samples: float) -> Array:
    """A first-order lag of so many samples, settled at the first one."""
    keep = float(np.exp(-1.0 / max(samples, 1e-9)))
    return filtered(np.array([1.0 - keep, 0.0, 0.0, 0.0]), np.array([1.0, -keep, 0.0, 0.0]), x)
