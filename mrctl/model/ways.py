"""The way that a velocity goes between two samples, running straight: for the vehicle and the desk alike."""

from __future__ import annotations


def ways(before_m_s: float, velocity_m_s: float, dt_s: float) -> tuple[float, float, float]:
    """The part of a sample after which the velocity turns, the way in m until then, and the way from there.

    Where it does not turn the first two are 0.
    """
    if before_m_s * velocity_m_s >= 0.0:
        return 0.0, 0.0, 0.5 * (before_m_s + velocity_m_s) * dt_s
    turned = before_m_s / (before_m_s - velocity_m_s)
    return turned, 0.5 * before_m_s * turned * dt_s, 0.5 * velocity_m_s * (1.0 - turned) * dt_s
