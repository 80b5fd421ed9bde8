"""Integrals of measured channels without drift.

Integration has a fourth-order rule and takes out the drift that an offset of the sensor adds up to: a
straight line. Where the motion repeats, the line is fitted *together with* the harmonics of the motion, so
that the number of cycles need not be whole, and the result has zero mean over whole cycles. Where it does not
repeat but goes to and fro, the line is fitted under a Hann window and the result starts at zero. One single
stroke is left as it is: no drift could be told from motion. (Curves instead of lines were tried on real
records and made the ends of a run worse.)
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from mrctl.measurements.derivative import noise_sigma
from mrctl.measurements.run import FloatArray

_HARMONICS = 5
_PERIODIC_SHARE = 0.98
"""Share of the velocity's variance that the harmonics must explain in the middle of a run that repeats."""


def cumulative_integral(values: FloatArray, dt: float) -> FloatArray:
    """The integral of `values` (n,) from the first sample on, exact for cubics."""
    if len(values) < 4:
        steps = 0.5 * (values[1:] + values[:-1])
    else:
        padded = np.concatenate(
            (
                [4 * values[0] - 6 * values[1] + 4 * values[2] - values[3]],
                values,
                [4 * values[-1] - 6 * values[-2] + 4 * values[-3] - values[-4]],
            )
        )
        steps = (13 * (padded[1:-2] + padded[2:-1]) - padded[:-3] - padded[3:]) / 24
    return np.concatenate(([0.0], np.cumsum(steps))) * dt


@dataclass(frozen=True, slots=True)
class Integral:
    """A drift-free integral, and in words how its drift and its zero were settled."""

    values: FloatArray
    how: str


def integrate(values: FloatArray, dt: float) -> Integral:
    """The integral of a rate (n,) without drift; see the module for what is taken out and where zero is."""
    total = cumulative_integral(values, dt)
    time = dt * np.arange(len(values), dtype=np.float64)
    strongest = motion_frequency(values, dt)
    if strongest is None:
        return Integral(total, "zero at the start; a single stroke, so no drift could be told from motion")
    frequency = _repeating(values, time, strongest)
    if frequency is not None:
        drift = _line_beside_harmonics(total, time, frequency)
        return Integral(total - drift, "zero mean over whole cycles, drift removed")
    result = total - hann_line(total)
    return Integral(result - result[0], "zero at the start, straight drift removed")


def hann_line(values: FloatArray) -> FloatArray:
    """The straight line through `values` (n,), weighted so that cycles cut at the ends do not tilt it."""
    weights = np.hanning(len(values) + 2)[1:-1]
    weights /= weights.sum()
    place = np.linspace(-1.0, 1.0, len(values))  # its weighted mean is zero by symmetry
    slope = np.sum(weights * place * values) / np.sum(weights * place**2)
    return np.asarray(np.sum(weights * values) + slope * place)


def motion_frequency(values: FloatArray, dt: float) -> float | None:
    """The strongest frequency of a motion in Hz, refined between bins; None for less than about one cycle."""
    count = len(values)
    centred = values - values.mean()
    if count < 16 or not np.any(centred):
        return None
    threshold = 0.1 * np.max(np.abs(centred))
    signs = np.sign(values[np.abs(values) > threshold])
    if np.count_nonzero(np.diff(signs)) < 2:
        return None
    padded = 4 << (count - 1).bit_length()
    power = np.abs(np.fft.rfft(centred * np.hanning(count), padded)) ** 2
    peak = int(np.argmax(power[1:-1])) + 1
    below, at, above = np.log(power[peak - 1 : peak + 2] + np.finfo(float).tiny)
    curvature = below - 2 * at + above
    offset = 0.5 * (below - above) / curvature if curvature < 0 else 0.0
    return float((peak + np.clip(offset, -0.5, 0.5)) / (padded * dt))


def _least_squares(basis: FloatArray, target: FloatArray) -> FloatArray:
    """The weights of the columns of `basis` (n, few) that come closest to `target` (n,).

    By the normal equations with unit columns and a ridge of 1e-12: a tenth of the time of an SVD, and
    harmonics of more than a cycle are far from collinear.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", basis, basis)) + np.finfo(float).tiny
    unit = basis / scale
    gram = unit.T @ unit + 1e-12 * np.eye(len(scale))
    return np.asarray(np.linalg.solve(gram, unit.T @ target) / scale)


def _harmonics(time: FloatArray, frequency: float) -> FloatArray:
    """Cosines and sines of the first harmonics, (n, 2 * harmonics)."""
    phases = 2 * pi * frequency * np.outer(time, np.arange(1, _HARMONICS + 1))
    return np.hstack((np.cos(phases), np.sin(phases)))


def _repeating(values: FloatArray, time: FloatArray, frequency: float) -> float | None:
    """The refined frequency if harmonics explain the middle half of the run, else None."""
    quarter = len(values) // 4
    middle = slice(quarter, len(values) - quarter)
    if (time[middle][-1] - time[middle][0]) * frequency < 1.5:
        middle = slice(None)
    stride = max(1, len(values[middle]) // 2000)
    part, when = values[middle][::stride], time[middle][::stride]
    orders = np.arange(1, _HARMONICS + 1)
    for _ in range(
        4
    ):  # Gauss-Newton on the frequency, which the spectrum's peak gives to a fraction of a bin
        basis = np.column_stack((np.ones(len(when)), _harmonics(when, frequency)))
        weights = _least_squares(basis, part)
        residual = part - basis @ weights
        cosines, sines = np.split(basis[:, 1:], 2, axis=1)
        slope = when * (
            cosines @ (orders * weights[1 + _HARMONICS :]) - sines @ (orders * weights[1 : 1 + _HARMONICS])
        )
        joint = np.column_stack((basis, 2 * pi * slope))
        frequency += float(_least_squares(joint, residual)[-1])
    left = float(np.var(residual))
    explained = left < (1 - _PERIODIC_SHARE) * float(np.var(part)) + 1.2 * noise_sigma(values) ** 2
    return frequency if explained and frequency * time[-1] > 1.0 else None


def _line_beside_harmonics(total: FloatArray, time: FloatArray, frequency: float) -> FloatArray:
    """The straight line in `total`, fitted together with the motion's harmonics."""
    # A thinned fit is as good: 40 samples a cycle hold five harmonics, and 20,000 the line.
    stride = int(min(1.0 / (frequency * (time[1] - time[0]) * 40), len(time) / 200))
    stride = max(1, stride, len(time) // 20_000)
    when = time[::stride]
    middle = when - 0.5 * time[-1]
    basis = np.column_stack((np.ones(len(when)), middle, _harmonics(when, frequency)))
    # Hann weights: ramps at the ends of the run, where the motion does not repeat yet, must not tilt the
    # line.
    weights = np.sqrt(np.hanning(len(when) + 2)[1:-1])
    level, slope = _least_squares(basis * weights[:, None], total[::stride] * weights)[:2]
    result: FloatArray = level + slope * (time - 0.5 * time[-1])
    return result
