"""The zero of the load cell, which is another in each run: no physics, and not to be taken for any.

A gas spring whose force is fitted over runs of different mean stroke takes up such offsets, as a rise of
temperature does where each run has its own. What is alike in all runs stays: that is an effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from mrctl.discover.channels.runs_own import Own
from mrctl.discover.fits.screen import ranges_of
from mrctl.identify.records import Record

Array = NDArray[np.float64]

FEWEST_RUNS = 3
CHANCE = 0.05  # that runs of one zero differ so: most rigs drift, so little speaks for it
LARGEST = 0.01  # of the largest force: no load cell wanders further, and the model is wrong, ...
MANY_RUNS = 6  # ... but in so many, where no rule is in them, ...
MOST_SPREAD, FARTHEST = 0.015, 0.04  # ... this in RMS, and each
LEAST_STROKE_M = 1e-5  # over the runs, RMS
BY_CONDITION = 0.01  # chance that zeros go with a condition of the runs as they do; less is physics
# Ranges over the runs that are no condition.
SAME = {"current_a": 1e-3, "temperature_c": 0.01, "velocity_m_s": 1e-4, "displacement_m": 1e-5}
COMMON = 3.0  # standard errors of the mean zero, above which it is an offset of all runs


def run_zeros(seen_n: Own, records: Sequence[Record], before_n: Array) -> Array:
    """Each run's zero in N (runs) by what is seen of it; zeros where all are one.

    Nor is there any where they go with the runs' currents, temperatures, speeds or strokes: an effect that
    the model lacks has a mean as well, which the base makes up for in some conditions at the cost of others.

    records: the runs, whose forces give the full scale. before_n (runs): what was taken off them already.
    """
    none = np.zeros(seen_n.values.size)
    if none.size < FEWEST_RUNS:
        return none
    if seen_n.chance > CHANCE:
        return before_n
    zeros = seen_n.values + before_n
    middle = float(zeros.mean())
    apart = zeros - middle
    share = apart / ranges_of(records).force_n
    far = float(np.max(np.abs(share)))
    if far > LARGEST and not (
        share.size >= MANY_RUNS
        and far <= FARTHEST
        and float(np.sqrt(np.mean(share**2))) <= MOST_SPREAD
        and not by_a_rule(apart, np.ones(share.size), records)
    ):
        return none
    if _by_a_condition(apart, records):
        return none
    # As many zeros as there are runs have a mean of their own.
    own = abs(middle) < COMMON * float(apart.std(ddof=1)) / np.sqrt(zeros.size)
    return zeros if own else apart


def _by_a_condition(apart: Array, records: Sequence[Record]) -> bool:
    """Whether zeros (runs) go with what the runs were made at."""
    varied = conditions_of(records)
    return any(_chance(c, apart) < BY_CONDITION / len(varied) for c in varied)


def conditions_of(records: Sequence[Record]) -> list[Array]:
    """What the runs were made at, one array (runs) for each that varies over them."""
    conditions = {
        "current_a": [float(np.mean(r.current_a)) for r in records],
        "temperature_c": [float(np.mean(r.temperature_c)) for r in records],
        "velocity_m_s": [float(np.std(r.velocity_m_s)) for r in records],
        "displacement_m": [float(np.mean(r.displacement_m)) for r in records],
    }
    return [np.array(values) for name, values in conditions.items() if np.ptp(values) > SAME[name]]


def by_a_rule(apart: Array, weights: Array, records: Sequence[Record]) -> bool:
    """Whether shares or zeros (runs) go with the runs' conditions, their squares or products."""
    stroke = np.array([float(np.std(r.displacement_m)) for r in records])
    made_at = [*conditions_of(records), *([stroke] if np.ptp(stroke) > LEAST_STROKE_M else [])]
    centred = [(c - np.average(c, weights=weights)) / max(float(np.std(c)), 1e-12) for c in made_at]
    rules = [*centred, *(a * b for a, b in combinations_with_replacement(centred, 2))]
    root = np.sqrt(weights)
    told = [r - np.average(r, weights=weights) for r in rules]
    told = [r for r in told if float(np.ptp(r)) > 1e-9]
    return any(_chance(root * r, root * apart) < BY_CONDITION / len(told) for r in told)


def _chance(one: Array, other: Array) -> float:
    """How likely values (n) that have nothing to do with each other correlate as much: Student's t."""
    freedom = one.size - 2
    if freedom < 1:
        return 1.0
    r = float(np.corrcoef(one, other)[0, 1])
    return float(2.0 * stdtr(freedom, -abs(r) * np.sqrt(freedom / max(1.0 - r * r, 1e-300))))
