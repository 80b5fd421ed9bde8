"""A velocity column that is the file's own stroke, differentiated and smoothed: told by its noise.

Smoothing takes off a differentiated stroke's noise, and with it the corners of the motion, where a damper is
steep: what it took would seem to be missing from the damper. Two sensors share the motion but not their
noise; a column made from the other shares both, at every frequency. Then the share H(f) that it kept is
known, and with it what it is worth: of a motion of density S in differentiated noise of density N, it misses
|1 - H|² S + |H|² N.
"""

from __future__ import annotations

import numpy as np

from mrctl.measurements.derivative import differentiate, noise_sigma
from mrctl.measurements.run import FloatArray
from mrctl.measurements.shared_spectra import ComplexArray, can_be_shared, rounding_density, shared

ROUNDING = 30.0  # times a column's rounding: less says nothing
SAME = 0.985  # coherence of what shares its noise
NOISY = 1.5  # times the stroke's white noise: less is noise for the most part
SMOOTHED = 0.7  # share of that noise that is kept, at most
FEWEST = 5  # frequencies
BETTER = 0.9  # of the mean square that the column misses, to be derived anew


def is_smoothed_stroke(velocity_m_s: FloatArray, displacement_m: FloatArray, dt_s: float) -> bool:
    """Whether the velocity (n) is the displacement (n) differentiated and smoothed, better derived anew."""
    v, x = velocity_m_s, displacement_m
    if not can_be_shared(v, x):
        return False
    raw = np.gradient(x, dt_s)
    f, kept, alike, power = shared(v, raw, dt_s)
    noise = 2.0 * dt_s * (noise_sigma(x) * np.sin(2.0 * np.pi * f * dt_s) / dt_s) ** 2
    shown = power * np.abs(kept) ** 2 > ROUNDING * rounding_density(v, dt_s)
    told = shown & (power < NOISY * noise)
    if np.count_nonzero(told) < FEWEST or float(np.median(alike[told])) < SAME:
        return False
    if float(np.median(np.abs(kept[told]))) > SMOOTHED:
        return False
    _, anew, _, _ = shared(differentiate(x, dt_s), raw, dt_s)
    motion = np.maximum(power - noise, 0.0)

    def bent(share: ComplexArray) -> float:
        return float(np.sum(np.abs(1.0 - share) ** 2 * motion))

    def noisy(share: ComplexArray) -> float:
        return float(np.sum(np.abs(share) ** 2 * noise))

    less_bent = bent(anew) < bent(kept)
    return less_bent and bent(anew) + noisy(anew) < BETTER * (bent(kept) + noisy(kept))
