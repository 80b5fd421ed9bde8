"""Where the zero of a stroke lies that was integrated from the velocity, and how it drifts: no file tells.

A stop is at one place of the cylinder. What is integrated has its middle at 0, wherever a run was made, and
where a run does not repeat its motion, the line taken out of it as the velocity's offset is a guess.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.joint import JointModel
from mrctl.identify.records import Record

Array = NDArray[np.float64]

FARTHEST = 0.25  # of a run's stroke, that its middle or its ends may be off
PLACES, ZOOMS = 7, 4  # looked at in turn, each time nearer
CLEARER = 0.1  # of a run's mean square, that another zero must take off


def stroke_zeros(
    model: JointModel,
    theta: Array,
    unknown: Sequence[bool],
    whole: Sequence[bool],
    within: float = FARTHEST,
) -> Array:
    """What to add to each record's stroke in m at its middle, and to its end's less its start's half.

    (records, 2), in the model's order; 0 where nothing is won by it. unknown: whose zeros are not known.
    whole: of which of these a drift can be carried over to other versions of them. within: share of a run's
    stroke, that it may be off.
    """
    reach = np.array([float(np.ptp(r.displacement_m)) for r in model.records]) * np.array(unknown)
    may = np.stack([reach, reach * np.array(whole)], axis=1)
    at = np.zeros_like(may)
    here = least = _errors(model, theta, at)
    for zoom in range(ZOOMS):
        for which in range(2):
            middle = at.copy()
            for share in np.linspace(-1.0, 1.0, PLACES):
                tried = middle.copy()
                tried[:, which] += share * within * may[:, which] * (2.0 / (PLACES - 1)) ** zoom
                there = _errors(model, theta, tried)
                better = there < least
                at, least = np.where(better[:, None], tried, at), np.where(better, there, least)
    won = least < (1.0 - CLEARER) * here
    # What all have in common is where the stop is.
    common = float(np.median(at[won, 0])) if won.sum() > 2 else 0.0
    return np.where(won[:, None], at - np.array([common, 0.0]), 0.0)


def moved(records: Sequence[Record], by_m: Array) -> list[Record]:
    """The records with their strokes moved as `stroke_zeros` says (records, 2)."""
    return [
        replace(r, displacement_m=r.displacement_m + by[0] + by[1] * np.linspace(-1.0, 1.0, len(r)))
        if by.any()
        else r
        for r, by in zip(records, by_m, strict=True)
    ]


def _errors(model: JointModel, theta: Array, by_m: Array) -> Array:
    """Each record's mean square error with its stroke moved."""
    return np.array([float(np.mean(e * e)) for e in model.placed(moved(model.records, by_m)).errors(theta)])
