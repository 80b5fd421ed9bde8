"""Derivatives of measured channels: no phase shift, no more noise and no more smoothing than needed.

Differentiation is a Savitzky-Golay filter whose window follows the data: of a ladder of windows, the one with
the least estimated mean square error. For a linear filter with kernel c on white noise of variance s^2 the
noise in the result is s^2 |c|^2, and two kernels differ by s^2 |c1 - c2|^2 plus the square of their
difference in bias, which is therefore measurable (Stein's unbiased risk). Clean data take the shortest
window, noisy data a longer.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb, sqrt

import numpy as np

from mrctl.measurements.run import FloatArray

_POLYNOMIAL = 4
_NOISE_ORDER = 5


def noise_sigma(values: FloatArray) -> float:
    """Standard deviation of white noise in a smooth signal: from fifth differences, median over blocks.

    A difference of order k turns noise of variance s^2 into comb(2k, k) s^2 and removes polynomials below k.
    """
    if len(values) <= _NOISE_ORDER:
        return 0.0
    squares = np.diff(values, _NOISE_ORDER) ** 2
    blocks = np.array_split(squares, max(1, min(20, len(squares) // 50)))
    return float(
        np.sqrt(np.median([block.mean() for block in blocks]) / comb(2 * _NOISE_ORDER, _NOISE_ORDER))
    )


def differentiate(values: FloatArray, dt: float, order: int = 1) -> FloatArray:
    """The derivative of `values` (n,) sampled every `dt` seconds: zero-phase, window chosen by the noise.

    `order` 1 or 2. Runs shorter than 7 samples fall back to plain differences.
    """
    if len(values) < _POLYNOMIAL + 3:
        result = values
        for _ in range(order):
            result = np.gradient(result, dt)
        return result
    return _filtered(values, _best_kernel(values, order), order) / dt**order


def _best_kernel(values: FloatArray, order: int) -> FloatArray:
    """The kernel of the ladder with the least estimated error on `values`."""
    parts = _samples(values)
    count = sum(map(len, parts))
    variance = float(np.mean([noise_sigma(part) ** 2 for part in parts]))
    best = kernel = _kernel(_POLYNOMIAL + 1, order)
    middles = [_convolved(part, kernel) for part in parts]
    least, bias = variance * float(kernel @ kernel), 0.0
    for window in _windows(len(parts[0])):
        wide = _kernel(window, order)
        wide_middles = [_convolved(part, wide) for part in parts]
        margin = (window - len(kernel)) // 2
        pairs = zip(wide_middles, middles, strict=True)
        step = float(np.mean([np.mean((new - old[margin : len(old) - margin]) ** 2) for new, old in pairs]))
        expected = variance * _distance(wide, kernel)
        # A step is bias where it is more than chance: it averages about count / window independent values.
        if step > expected * (1.0 + 3.0 * sqrt(2.0 * window / count)):
            bias += sqrt(step - expected)
        risk = bias**2 + variance * float(wide @ wide)
        if risk < least:
            best, least = wide, risk
        elif bias**2 > 4.0 * least:
            break
        kernel, middles = wide, wide_middles
    return best


def _samples(values: FloatArray) -> list[FloatArray]:
    """Stretches that stand for a long run when its window is chosen; a short run stands for itself."""
    stretch, pieces = 25_000, 4
    if len(values) <= stretch * pieces:
        return [values]
    starts = np.linspace(0, len(values) - stretch, pieces).astype(int)
    return [values[start : start + stretch] for start in starts]


def _windows(count: int) -> list[int]:
    """Odd windows, each about 1.4 times the one before, up to a third of the run."""
    windows: list[int] = []
    size = _POLYNOMIAL + 1
    while True:
        size = max(size + 2, 2 * round(size * 0.7) + 1)
        if size > count // 3:
            return windows
        windows.append(size)


@lru_cache(maxsize=256)
def _kernel(window: int, order: int) -> FloatArray:
    """The coefficients of a Savitzky-Golay derivative at the middle of the window, for unit sample time.

    The least-squares polynomial through the window has coefficients (P'P)^-1 P'y in a Legendre basis P.
    """
    grid = np.linspace(-1.0, 1.0, window)
    basis = np.polynomial.legendre.legvander(grid, _POLYNOMIAL)
    identity = np.eye(_POLYNOMIAL + 1)
    derivatives = np.polynomial.legendre.legder(identity, order)
    at_middle = np.polynomial.legendre.legval(0.0, derivatives)
    weights = basis @ np.linalg.solve(basis.T @ basis, at_middle)
    return np.asarray(weights * (2.0 / (window - 1)) ** order)


def _convolved(values: FloatArray, kernel: FloatArray) -> FloatArray:
    """Every whole window of `values` times `kernel`, (n - window + 1,)."""
    if len(kernel) < 64:
        return np.correlate(values, kernel, mode="valid")
    size = 1 << (len(values) - 1).bit_length()
    spectrum = np.fft.rfft(values, size) * np.conj(np.fft.rfft(kernel, size))
    return np.fft.irfft(spectrum, size)[: len(values) - len(kernel) + 1]


def _filtered(values: FloatArray, kernel: FloatArray, order: int) -> FloatArray:
    """The derivative with `kernel`; half a window at either end by the polynomial of the last window."""
    window = len(kernel)
    half = window // 2
    grid = np.linspace(-1.0, 1.0, window)
    ends = []
    for part, where in ((values[:window], grid[:half]), (values[-window:], grid[-half:])):
        fit = np.polynomial.Polynomial.fit(grid, part, _POLYNOMIAL)
        ends.append(fit.deriv(order)(where) * (2.0 / (window - 1)) ** order)
    return np.concatenate((ends[0], _convolved(values, kernel), ends[1]))


def _distance(wide: FloatArray, narrow: FloatArray) -> float:
    """|wide - narrow|^2 of two centred kernels."""
    difference = wide.copy()
    margin = (len(wide) - len(narrow)) // 2
    difference[margin : margin + len(narrow)] -= narrow
    return float(difference @ difference)
