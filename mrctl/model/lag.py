"""Lags of first and second order, for the vehicle and compiled for the desk alike."""

from __future__ import annotations


def lagged(x: float, before: float, lag_s: float, dt_s: float) -> float:
    """What follows x with a time constant, `before` a step ago; x itself where that is 0.

    Implicit Euler: smooth in the time constant down to 0, and late by just that, for any step.
    """
    return (lag_s * before + dt_s * x) / (lag_s + dt_s)


def swung(x: float, before: float, earlier: float, lag_s: float, swing: float, dt_s: float) -> float:
    """What follows x as swing lag^2 y'' + lag y' + y = x, one and two steps ago given; x where the lag is 0.

    Implicit Euler as in `lagged`, which this is where the swing is 0.
    """
    first = lag_s / dt_s
    second = swing * first * first
    return (x + first * before + second * (2.0 * before - earlier)) / (1.0 + first + second)
