"""A first-order lag, for the vehicle and compiled for the desk alike."""

from __future__ import annotations


def lagged(x: float, before: float, lag_s: float, dt_s: float) -> float:
    """What follows x with a time constant, `before` a step ago; x itself where that is 0.

    Implicit Euler: smooth in the time constant down to 0, and late by just that, for any step.
    """
    return (lag_s * before + dt_s * x) / (lag_s + dt_s)
