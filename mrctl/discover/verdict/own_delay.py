"""A filter may be late by itself: a delay of the force that small is taken up, and not named."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrctl.discover.fits.proof import Proof
from mrctl.discover.search.levels import Trial
from mrctl.identify.joint_fit import JointFit, half_width_95
from mrctl.model.effects.base import Effect, Stage, Vector

NAME = "sensor_delay"
OWN_DELAY_S = 8e-4  # H may hold as much itself: as published, a sample of 2 kHz and half of one that is held
OWN_SAMPLES = 0.5  # and half of any sample, as a held value and a difference backward are late
FAR_OUT = 2.0  # times that: a delay so large is one, however wide its interval


def is_filters(trial: Trial) -> bool:
    """Whether an effect is but what a filter of the base may hold itself, or cannot be told from it."""
    if trial.effect.name != NAME or trial.effect.stage is not Stage.OUTPUT:
        return False
    delay_s = trial.fit.effect_values[NAME][0]
    own_s = filters_own_s(trial.fit)
    if delay_s <= own_s or delay_s > FAR_OUT * own_s:
        return delay_s <= own_s
    return delay_s - half_width_95(trial.fit.effect_std()[NAME][0]) <= own_s


def filters_own_s(fit: JointFit) -> float:
    """The largest delay in s that a filter may hold itself: the records' sample times bear on it."""
    return max(OWN_DELAY_S, OWN_SAMPLES * _sample_s(fit))


def with_hold(fit: JointFit, name: str, std: Vector) -> Vector:
    """An effect's standard deviations (SI) with what sampling leaves open of a delay, which no noise shows.

    A filter takes its input as straight between samples. What that rounds off it makes up for by letting a
    little through at once, and a delay is then longer by up to half a sample (0.39 behind a plain lag).
    """
    if name != NAME:
        return std
    return (float(np.hypot(std[0], _sample_s(fit) / np.sqrt(12.0))), *std[1:])


def _sample_s(fit: JointFit) -> float:
    """The longest time between two samples that were measured."""
    return max(r.finer / r.rate_hz for r in fit.model.records)


def why_own(final: Proof, found: Sequence[str], known: Sequence[Effect]) -> dict[str, str]:
    """Why a delay that was taken up is not named, by the effect's name."""
    values = final.fit.effect_values.get(NAME)
    if values is None or NAME in {*found, *(e.name for e in known)}:
        return {}
    return {NAME: f"the filter may be late by itself: {1e3 * values[0]:.2g} ms are taken as its own"}
