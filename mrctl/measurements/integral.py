"""Integrals of measured channels without drift.

Integration has a fourth-order rule and takes out the drift that an offset of the sensor adds up to: a
straight line. Where the motion repeats, the line is fitted *together with* the harmonics of the motion, so
that the number of cycles need not be whole, and the result has zero mean over whole cycles. Where it does not
repeat but goes to and fro, the line is fitted under a Hann window and zero is the middle of the stroke, about
which a rig moves. A cycle or two are left as they are: no drift could be told from motion. (Curves instead
of lines were tried on real records and made the ends of a run worse.)
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
import numpy.typing as npt

from mrctl.measurements.derivative import noise_sigma
from mrctl.measurements.run import FloatArray

_HARMONICS = 5
_ITERATIONS = 4
_EXACT = 1e-8  # of a frequency: less moves a hundred cycles by a few millionths of their amplitude
_CYCLES_FOR_A_LINE = 2.3
"""Of a motion that does not repeat: through one cycle the line is off by more than the motion, through two by
a third of it; a velocity's offset of 2 % adds up to a tenth."""
_PERIODIC_SHARE, _STEADY_SHARE = 0.98, 0.01
"""A run repeats if harmonics explain this share of the velocity's variance in its middle, and is steady where
they leave, over half a cycle, no more than the second share."""


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
    found = _repeating(values, time, strongest)
    if found is not None:
        drift = _line_beside_harmonics(total, time, *found)
        return Integral(total - drift, "zero mean over whole cycles, drift removed")
    few = strongest * time[-1] < _CYCLES_FOR_A_LINE
    result = total if few else total - hann_line(total)
    middle = 0.5 * (float(result.max()) + float(result.min()))
    how = "too few cycles, so no drift could be told from motion" if few else "straight drift removed"
    return Integral(result - middle, f"zero in the middle of the stroke, {how}")


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
    """The weights of the rows of `basis` (few, n) that come closest to `target` (n,).

    By the normal equations of unit rows with a ridge of 1e-12: a tenth of the time of an SVD, and harmonics
    of more than a cycle are far from collinear.
    """
    gram = basis @ basis.T
    scale = np.sqrt(np.diag(gram)) + np.finfo(float).tiny
    gram = gram / np.outer(scale, scale) + 1e-12 * np.eye(len(scale))
    return np.asarray(np.linalg.solve(gram, (basis @ target) / scale) / scale)


def _harmonics(time: FloatArray, frequency: float, more: int = 0) -> FloatArray:
    """Cosines and sines of the first harmonics, (more + 2 * harmonics, n), behind as many rows of ones."""
    first = np.exp(2j * pi * frequency * time)
    rows = np.ones((more + 2 * _HARMONICS, len(time)))
    power = first
    for order in range(_HARMONICS):
        rows[more + order], rows[more + _HARMONICS + order] = power.real, power.imag
        power = power * first
    return rows


def _repeating(values: FloatArray, time: FloatArray, frequency: float) -> tuple[float, slice] | None:
    """The refined frequency of a motion that repeats and the rows where it does, without ramps; else None.

    The middle half of the run decides, since ramps stand at the ends; then where it is steady.
    """
    quarter = len(values) // 4
    rows = slice(quarter, len(values) - quarter)
    if _duration(time, rows) * frequency < 1.5:
        rows = slice(0, len(values))
    noise = noise_sigma(values) ** 2
    for _ in range(2):
        fit = _fit(values, time, frequency, rows)
        if fit.frequency <= 0 or fit.residual >= (1 - _PERIODIC_SHARE) * fit.variance + 1.2 * noise:
            return None
        steady = _steady(values, time, fit, _STEADY_SHARE * fit.variance + 1.5 * noise)
        if _duration(time, steady) * fit.frequency < 1.0:
            break
        rows, frequency = steady, fit.frequency
    return (frequency, rows) if frequency * time[-1] > 1.0 else None


def _duration(time: FloatArray, rows: slice) -> float:
    """From the first to the last of some rows, in s."""
    part = time[rows]
    return float(part[-1] - part[0]) if len(part) else 0.0


@dataclass(frozen=True, slots=True)
class _Fit:
    """Mean and harmonics of a motion: weights, and the variances of the motion and of what they leave."""

    frequency: float
    weights: FloatArray
    variance: float
    residual: float


def _fit(values: FloatArray, time: FloatArray, frequency: float, rows: slice) -> _Fit:
    """Harmonics and their frequency over some rows, thinned to some 2,000."""
    stride = max(1, len(values[rows]) // 2000)
    part, when = values[rows][::stride], time[rows][::stride]
    orders = np.arange(1, _HARMONICS + 1)
    # Gauss-Newton on the frequency, which the spectrum gives to a fraction of a bin.
    for _ in range(_ITERATIONS):
        basis = _harmonics(when, frequency, more=1)
        weights = _least_squares(basis, part)
        residual = part - weights @ basis
        fit = _Fit(frequency, weights, float(np.var(part)), float(np.var(residual)))
        cosines, sines = np.split(basis[1:], 2)
        of_cosines, of_sines = np.split(weights[1:], 2)
        slope = (orders * of_sines) @ cosines - (orders * of_cosines) @ sines
        joint = np.vstack((basis, 2 * pi * when * slope))
        step = float(_least_squares(joint, residual)[-1])
        frequency += step
        if abs(step) < _EXACT * frequency:
            break
    return fit


def _steady(values: FloatArray, time: FloatArray, fit: _Fit, limit: float) -> slice:
    """The rows where a fit leaves no more than `limit` in the mean square over half a cycle."""
    stride = max(1, len(values) // 4000)
    part, when = values[::stride], time[::stride]
    residual = part - fit.weights @ _harmonics(when, fit.frequency, more=1)
    half = int(0.5 / (fit.frequency * (time[1] - time[0]) * stride))
    half = max(1, min(half, len(when) // 2))
    square = np.convolve(residual**2, np.full(half, 1.0 / half), mode="same")
    steady = _longest(square < limit, stride)
    reach = int(0.4 * half * stride)  # the mean over half a cycle looks nearly half of that ahead
    return slice(max(0, steady.start - reach), steady.stop + reach)


def _longest(mask: npt.NDArray[np.bool_], stride: int) -> slice:
    """The longest stretch of true values, in rows."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return slice(0, 0)
    best = int(np.argmax(ends - starts))
    return slice(int(starts[best]) * stride, int(ends[best]) * stride)


def _line_beside_harmonics(
    total: FloatArray, time: FloatArray, frequency: float, steady: slice
) -> FloatArray:
    """The straight line in `total`, fitted together with the motion's harmonics where it repeats."""
    part, when = total[steady], time[steady]
    # A thinned fit is as good: 40 samples a cycle hold five harmonics, and 20,000 the line.
    stride = int(min(1.0 / (frequency * (time[1] - time[0]) * 40), len(when) / 200))
    stride = max(1, stride, len(when) // 20_000)
    when = when[::stride]
    centre = 0.5 * (when[0] + when[-1])
    basis = _harmonics(when, frequency, more=2)
    basis[1] = when - centre
    # Hann weights: what is left of ramps at the ends must not tilt the line.
    weights = np.sqrt(np.hanning(len(when) + 2)[1:-1])
    level, slope = _least_squares(basis * weights, part[::stride] * weights)[:2]
    result: FloatArray = level + slope * (time - centre)
    return result
