"""How the reported force moves with the force at the rod, for many small changes at once."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mrctl.model.effects.base import Effect, Vector
from mrctl.simulate.run import Array, Ints
from mrctl.simulate.stages import Chosen, measured

PUSH = 1e-4  # of the force's RMS, when a change is pushed through an effect by a difference
FADED = 1e-12  # of a filter's largest answer to an impulse: what comes after less is nothing


def output_slopes(chosen: Chosen, force_n: Array, dt_s: float, starts: Ints, rows: Array) -> Array:
    """The changes (m, n) of the force that the sensor reports, by those (m, n) of the force (n) at it."""
    for place, (effect, p) in enumerate(chosen):
        if place:
            force_n = measured([chosen[place - 1]], force_n, dt_s, starts)
        if effect.linear:
            rows = _filtered(effect, p, dt_s, starts, rows)
        else:
            rows = _pushed(effect, p, force_n, dt_s, starts, rows)
    return rows


def _filtered(effect: Effect, p: Vector, dt_s: float, starts: Ints, rows: Array) -> Array:
    """Each change through a fixed filter, which its answer to an impulse says; the first lasts for ever."""
    chosen = [(effect, p)]
    impulse = np.zeros(1 + int(np.diff(starts).max()))
    impulse[1] = 1.0  # not the first, which would have lasted
    answer = measured(chosen, impulse, dt_s)[1:]
    taps = np.flatnonzero(np.abs(answer) > FADED * np.abs(answer).max())
    later = measured(chosen, np.ones(1), dt_s)[0] - answer[taps].sum()  # from before any stretch
    out = np.empty_like(rows)
    for begin, end in pairwise(starts.tolist()):
        part, first = out[:, begin:end], rows[:, begin : begin + 1]
        part[:] = later * first
        for tap in taps.tolist():
            late = min(tap, end - begin)
            part[:, :late] += answer[tap] * first
            part[:, late:] += answer[tap] * rows[:, begin : end - late]
    return out


def _pushed(effect: Effect, p: Vector, force_n: Array, dt_s: float, starts: Ints, rows: Array) -> Array:
    """Each change through any effect: what it gives beside the force, less what it gives of that alone."""
    here = measured([(effect, p)], force_n, dt_s, starts)
    size = float(np.sqrt(np.mean(force_n * force_n))) or 1.0
    out = np.zeros_like(rows)
    for row, changed in zip(rows, out, strict=True):
        steepness = float(np.abs(row).max())
        if steepness > 0.0:
            small = PUSH * size / steepness
            changed[:] = (measured([(effect, p)], force_n + small * row, dt_s, starts) - here) / small
    return out
