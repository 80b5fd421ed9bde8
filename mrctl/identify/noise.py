"""The colour of what a fit leaves over: how many samples count as one, run by run."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

SCALE = 1.4826  # of the median deviation, for a normal distribution
PERIODIC = 0.9  # correlation of a motion with itself a cycle later
LEAST_SHARE = 0.2  # no run's noise is taken below this share of the median: a run at rest fits too well


def correlation_inflation(residual: Array) -> float:
    """Samples of the residual that count as one: 1 + 2 sum of its autocorrelations.

    Summed up to five times the result (Sokal's window).
    """
    n = residual.size
    if n < 16:
        return 1.0
    correlation = _lagged_products(residual - residual.mean())
    if correlation[0] <= 0.0:
        return 1.0
    time = 2.0 * np.cumsum(correlation / correlation[0]) - 1.0
    window = np.arange(time.size) >= 5.0 * time
    at = int(np.argmax(window)) if window.any() else time.size - 1
    return float(np.clip(time[at], 1.0, n / 8.0))


def repeated(motion: Array, residual: Array) -> float:
    """How often a residual says the same: of n cycles of a motion n times, of what comes again in each.

    motion, residual: (n). 1 for noise, and where the motion does not repeat.
    """
    if residual.size < 16:
        return 1.0
    alike = _autocorrelation(motion)
    turned = int(np.argmax(alike < 0.0))
    again = np.append(alike[turned:] > PERIODIC, False)
    if turned == 0 or not again.any():
        return 1.0
    first = int(np.argmax(again))
    last = first + int(np.argmin(again[first:]))
    at = turned + first + int(np.argmax(alike[turned + first : turned + last]))
    cycles = residual.size / at
    return 1.0 + (cycles - 1.0) * max(float(_autocorrelation(residual)[at]), 0.0)


def _autocorrelation(x: Array) -> Array:
    """Of x (n), at lags up to half of it: of the parts that overlap."""
    centred = x - x.mean()
    squares = np.concatenate([[0.0], np.cumsum(centred**2)])
    lags = np.arange(x.size // 2)
    sizes = np.sqrt(squares[x.size - lags] * (squares[-1] - squares[lags]))
    return np.asarray(_lagged_products(centred) / np.maximum(sizes, 1e-300))


def _lagged_products(x: Array) -> Array:
    """The sums of x (n) times itself later, at lags up to half of it."""
    size = 1 << (2 * x.size - 1).bit_length()
    return np.asarray(np.fft.irfft(np.abs(np.fft.rfft(x, size)) ** 2)[: x.size // 2])


def usual_n2(residual: Array) -> float:
    """The mean square in N², which a few wild samples do not raise, times the samples that count as one."""
    return (SCALE * float(np.median(np.abs(residual)))) ** 2 * correlation_inflation(residual)


def record_noise(residuals: list[Array], floor_n: float) -> Array:
    """Noise RMS in N of each record, none taken far below the others."""
    rms = np.array([float(np.sqrt(np.mean(r * r))) for r in residuals])
    floor = max(LEAST_SHARE * float(np.median(rms)), floor_n)
    return np.asarray(np.maximum(rms, floor), dtype=np.float64)


def autoregression(residual: Array, largest: int = 12) -> tuple[Array, float]:
    """(a, variance): the model a(z) r = white noise of that variance; its order by BIC (Levinson-Durbin)."""
    n = residual.size
    centred = residual - residual.mean()
    largest = min(largest, n // 10)
    c = np.array([float(centred[: n - k] @ centred[k:]) / n for k in range(largest + 1)])
    if c[0] <= 0.0:
        return np.ones(1), 0.0
    a, variance = np.ones(1), float(c[0])
    best, best_score = (a, variance), n * np.log(variance)
    for order in range(1, largest + 1):
        reflection = -float(a @ c[order - np.arange(order)]) / variance
        longer = np.append(a, 0.0)
        a = longer + reflection * longer[::-1]
        variance *= 1.0 - reflection * reflection
        score = n * np.log(max(variance, 1e-300)) + order * np.log(n)
        if score < best_score:
            best, best_score = (a, variance), score
    return best


def coloured_gram(rows: Array, residual: Array) -> Array:
    """The product rows S rows' (m, m); S: covariance of noise coloured as the residual is; rows (m, n)."""
    a, variance = autoregression(residual)
    if a.size == 1:
        return np.asarray(variance * (rows @ rows.T), dtype=np.float64)
    shaped = np.array(rows, dtype=np.float64)
    _recur_backwards(a, shaped)
    return np.asarray(variance * (shaped @ shaped.T), dtype=np.float64)


@njit(cache=True)
def _recur_backwards(a, rows):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - compiled
    """Each row (m, n) through 1 / a(z), from its end: in place."""
    count, n = rows.shape
    for row in range(count):
        for k in range(n - 1, -1, -1):
            for j in range(1, min(a.size, n - k)):
                rows[row, k] -= a[j] * rows[row, k + j]
