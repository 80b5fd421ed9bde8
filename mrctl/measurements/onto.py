"""A channel on another clock: sensors along straight lines, what a driver was asked for from its stamp on."""

from __future__ import annotations

import numpy as np

from mrctl.measurements.run import BY_ATTRIBUTE, FloatArray

REPEATS = 0.5  # of the samples, that are the one before in a current that is a wish; a sensor's noise is not
SPARSE = 1.5  # grid steps between samples: a current that is sent no more often was sent as it changed


def onto(grid_s: FloatArray, time_s: FloatArray, values: FloatArray, name: str) -> FloatArray:
    """A channel (attribute of `Run`) of samples (n,) at times in s, on an even grid (m,) in s.

    A step that is held comes at the instant of the grid that is next to its stamp: one that waited for the
    grid to pass the stamp would be late by half a sample in the mean.
    """
    if values.ndim == 0 or len(values) == 1:
        return values
    if not is_held(grid_s, time_s, values, name):
        return np.interp(grid_s, time_s, values)
    places = np.searchsorted(time_s, grid_s + 0.5 * _step_s(grid_s), side="right") - 1
    return values[np.clip(places, 0, len(values) - 1)]


def is_held(grid_s: FloatArray, time_s: FloatArray, values: FloatArray, name: str) -> bool:
    """Whether a channel holds each sample until the next: all that may, but a current that was measured."""
    if not BY_ATTRIBUTE[name].held or len(values) < 2:
        return BY_ATTRIBUTE[name].held
    asked = name != "current_a" or float(np.mean(np.diff(values) == 0.0)) > REPEATS
    return asked or float(np.median(np.diff(time_s))) > SPARSE * _step_s(grid_s)


def _step_s(grid_s: FloatArray) -> float:
    return float(grid_s[1] - grid_s[0]) if len(grid_s) > 1 else 0.0
