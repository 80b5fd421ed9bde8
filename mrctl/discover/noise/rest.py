"""Where a run rests: there the velocity that is measured is noise, and no motion.

A friction holds at rest what it had, or a fluid before it yields. By a velocity of noise it would slide to
and fro until nothing is left of it; and what it holds before the first motion, no file tells.
An actuator's hunting is as small and may be as white; but the force goes with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.noise.motion_noise import Spectrum
from mrctl.identify.records import SHORTEST, Record

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

WINDOW_S, WINDOWS = 0.05, 3  # over which a motion would show in the mean; so many make a rest
SIGMAS = 6.0  # of the noise's deviation, in one sample and in a mean, that are no motion: it is an estimate
GOES_WITH = 0.3  # correlation of force and velocity, of more than which a velocity is no noise
LONGEST_S = 5.0  # that a run is cut by: a longer rest may warm a fluid


def stilled(record: Record, spectrum: Spectrum | None) -> tuple[Record, float]:
    """The record, its motion nothing where it rests, and cut to where its first rest ends; the rests in s.

    Not cut where the current changes before the motion begins: a field remembers that. Itself where none is.
    """
    resting = rests(record, spectrum)
    if not resting.any():
        return record, 0.0
    rest_s = float(np.count_nonzero(resting)) / record.rate_hz
    velocity, acceleration = (
        np.where(resting, 0.0, x) for x in (record.velocity_m_s, record.acceleration_m_s2)
    )
    still = replace(record, velocity_m_s=velocity, acceleration_m_s2=acceleration)
    first = int(np.argmin(resting))
    steady = first > 0 and float(np.ptp(record.current_a[:first])) <= 0.0
    if not steady or first > LONGEST_S * record.rate_hz or len(record) - first < SHORTEST:
        return still, rest_s
    return still.part(first, len(record)), rest_s


def rests(record: Record, spectrum: Spectrum | None) -> Bools:
    """Where (n) a record's velocity is nothing but the noise of that spectrum, for some time on end."""
    v = record.velocity_m_s
    window = _samples(WINDOW_S, record)
    quiet = np.abs(v) <= SIGMAS * _noise_m_s(record, spectrum, 1)
    quiet &= np.abs(_means(v, window)) <= SIGMAS * _noise_m_s(record, spectrum, window)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(np.int8)))
    found = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        # What creeps shows in the mean over all of it.
        size = int(end - begin)
        if size >= WINDOWS * window and abs(float(v[begin:end].mean())) <= SIGMAS * _noise_m_s(
            record, spectrum, size
        ):
            found.append(slice(begin, end))
    resting = np.zeros(v.size, dtype=bool)
    for stretch in [] if _moves(record, found) else found:
        resting[stretch] = True
    return resting


def _moves(record: Record, stretches: Sequence[slice]) -> bool:
    """Whether the force goes with the velocity where a record seems to rest: an actuator that hunts, say."""
    if not stretches:
        return False
    velocity, force = (
        np.concatenate([x[k] - x[k].mean() for k in stretches]) for x in (record.velocity_m_s, record.force_n)
    )
    sizes = np.linalg.norm(velocity) * np.linalg.norm(force)
    return bool(velocity @ force > GOES_WITH * sizes)


def _means(x: Array, window: int) -> Array:
    """The moving mean (n); at the ends, that of the first and last whole window."""
    if x.size < window:
        return np.full(x.size, x.mean())
    means = np.convolve(x, np.full(window, 1.0 / window), mode="valid")
    return np.pad(means, ((window - 1) // 2, window // 2), mode="edge")


def _samples(seconds: float, record: Record) -> int:
    return max(1, round(seconds * record.rate_hz))


def _noise_m_s(record: Record, spectrum: Spectrum | None, samples: int) -> float:
    """The standard deviation of the noise's mean over so many samples; none where no noise is seen."""
    if spectrum is None:
        return 0.0
    f = np.linspace(0.0, 0.5 * record.rate_hz / record.finer, 1 + max(512, samples))
    level = spectrum.at(f, record.run) * np.sinc(f * samples / record.rate_hz) ** 2
    return float(np.sqrt(level.sum() * f[1]))
