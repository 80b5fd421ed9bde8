"""Sec. 6.2: the frequency responses of all FIR filters and their average (Eq. 6.3).

A response is known only where its input had power. A sine gives a line spectrum: 2.4, 7.2, 11.9 and 16.7 Hz
below the 20 Hz low-pass, nothing between and, the measured force being filtered, nothing above. Filters
of a quarter of a second can tell these lines apart, so what they do between two lines is free; LMS starts
from zero and leaves it small. `Spectrum` says where the power is, and the lower-order fit goes by it alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.paper.backbone import Backbones
from mrctl.identify.paper.fir import AdaptiveFilters
from mrctl.identify.paper.prepare import Preparation

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

POINTS = 2000  # frequencies of the curves, from 0 to half the sample rate
CELL_HZ = 0.25  # power nearer together than this counts as at one frequency


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Where the backbone forces have power up to the low-pass: frequency_hz, power (L each); in sum 1."""

    frequency_hz: Array
    power: Array


@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """frequency_hz (F); by_run (runs, F), of the LMS filters; universal (F), their mean; fir, its filter."""

    frequency_hz: Array
    by_run: Complex
    universal: Complex
    fir: Array
    spectrum: Spectrum


def responses(
    preparation: Preparation, curves: Backbones, filters: AdaptiveFilters, cutoff_hz: float
) -> Responses:
    """The frequency responses of all runs' filters and their average.

    Averaging real and imaginary parts is averaging the coefficients.
    """
    rate = preparation.sample_rate_hz
    frequency = np.linspace(0.0, 0.5 * rate, POINTS + 1)
    weights = np.stack([run.lms for run in filters.runs])
    by_run = np.fft.rfft(weights, 2 * POINTS, axis=1)
    fir = weights.mean(axis=0)
    return Responses(frequency, by_run, by_run.mean(axis=0), fir, _spectrum(preparation, curves, cutoff_hz))


def fir_response(weights: Array, frequency_hz: Array, rate_hz: float) -> Complex:
    """The complex response of a FIR filter (taps, newest first) at any frequencies."""
    angle = np.outer(frequency_hz, np.arange(weights.size)) * (-2.0 * np.pi / rate_hz)
    return np.asarray(np.exp(1j * angle) @ weights, dtype=np.complex128)


def _spectrum(preparation: Preparation, curves: Backbones, cutoff_hz: float) -> Spectrum:
    """Each run's power with the same say; over whole cycles a sine's harmonics are single lines."""
    cells = int(cutoff_hz / CELL_HZ) + 1
    power, moment = np.zeros(cells), np.zeros(cells)
    for row, record in enumerate(preparation.records):
        back = record.cut(curves.over_time(row, record.velocity_m_s))
        lines = np.abs(np.fft.rfft(back)) ** 2
        frequency = np.fft.rfftfreq(back.size, 1.0 / preparation.sample_rate_hz)
        seen = frequency <= cutoff_hz
        at = (frequency[seen] / CELL_HZ).astype(np.intp)
        share = lines[seen] / lines[seen].sum()
        power += np.bincount(at, share, cells)[:cells]
        moment += np.bincount(at, share * frequency[seen], cells)[:cells]
    used = power > 0.0
    return Spectrum(moment[used] / power[used], power[used] / power.sum())
