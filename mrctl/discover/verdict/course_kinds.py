"""What physics outside the library does to a force, and what would show it by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.verdict.course_memory import (
    LEAST_A,
    after_current,
    after_speed,
    after_turning,
    fading,
    lagged,
    relaxing,
    rested,
)
from mrctl.discover.verdict.course_signals import Columns, Level, Signals, product
from mrctl.identify.records import Record

Array = NDArray[np.float64]

SHORT_S = 0.01  # over which an acceleration is taken
LEAST_K = 2.0  # that the temperature must change by, for anything to hang on it


@dataclass(frozen=True)
class Kind:
    """A course in words, the columns that it may have, and effects that it may be another form of."""

    words: str
    measure: str
    make: Callable[[Signals], Iterator[Columns]]
    alike: tuple[str, ...] = ()
    low: float = -np.inf  # of a column's size: a rubber's stiffness is not negative


def _with_acceleration(s: Signals) -> Iterator[Columns]:
    yield Columns([s.each(lambda r, f: f * np.abs(lagged(r.acceleration_m_s2, SHORT_S * r.rate_hz)))])


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


def _bent_cell(s: Signals) -> Iterator[Columns]:
    """A force that is told too large or too small where it is large."""
    most = max(float(np.max(np.abs(f))) for f in s.forces)
    if most > 0.0:
        yield Columns([s.each(lambda _, f, p: f * (f / most) ** p, power) for power in (1, 2)])


def _signed(r: Record, power: float) -> Array:
    """The speed to a power, with the velocity's sign; at the power 0 soft about standstill."""
    v = r.velocity_m_s
    if power == 0.0:
        return np.tanh(v / max(0.02 * float(np.abs(v).max()), 1e-9))
    return np.sign(v) * np.abs(v) ** power


def _current(r: Record) -> Array:
    return r.current_a


def _warmth(r: Record) -> Array:
    return r.temperature_c


def _stroke(r: Record) -> Array:
    return r.displacement_m


_RUN, _PATH, _ENERGY = (
    partial(fading, driver=driver)
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
        after_speed,
    ),
    Kind(
        "is higher after a rest, until the motion has broken that down",
        "the same sine after a rest of a second, of ten and of a minute, one current",
        rested,
        low=0.0,
    ),
    Kind(
        "hangs on the mean current of the last moments",
        "a sine right after a minute at full current, and after one at none",
        after_current,
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
        after_turning,
        ("preyield_stiffness", "coulomb_friction", "mount_compliance", "sensor_delay"),
    ),
    Kind("has a stiffness that relaxes", "a step of the stroke, held for ten seconds", relaxing, low=0.0),
    Kind(
        "is told too large or too small where it is large",
        "known weights on the load cell",
        _bent_cell,
        ("rebound_asymmetry",),
    ),
)
