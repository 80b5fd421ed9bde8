"""Channels that were stored as moving means: found by their spectra, and what a model must do about it.

A mean over N samples takes out every multiple of 1/N of the sample rate, whatever the signal: the logarithm
of the spectrum dips at even steps, and its transform, the cepstrum, is -1, -1/2, -1/3 at N, 2N, 3N (Oppenheim
and Schafer, Discrete-Time Signal Processing, ch. 13). A reversal that takes 10 ms looks as long as the window
in such data, at every speed; no damper does that. So the model's force is averaged alike before the two are
compared, and the damper behind the mean is what is identified.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrctl.measurements.moving_means import smoothed
from mrctl.measurements.run import FloatArray, Run

SHORTEST = 3  # samples
LARGEST_SHARE = 16  # of a run: its window is no longer than one part in so many
LOOKED_AT = 1 << 16  # samples of a long run
LEAST_COMB = 0.5
"""Of 1 for a mean. Force alone reaches it now and then (steps that come at even times); both channels at one
window reached it in one of 350 simulated runs, which the contrast then refused."""
LEAST_CONTRAST = 1.4  # to any window that is no multiple or part of it
HARMONICS = (1, 2, 3)


def averaged_over_s(force_n: FloatArray, motion: FloatArray, dt_s: float) -> float:
    """The window in s over which force and motion (n each) are moving means; 0 where they are none.

    Both have to show the same one: a single channel may have even dips by chance, and a single averaged
    channel would be late by an unknown part of its window.
    """
    windows = {_window(force_n), _window(motion)}
    return windows.pop() * dt_s if len(windows) == 1 else 0.0


def believed(runs: Sequence[Run]) -> tuple[Run, ...]:
    """The runs as they are where means were found in half of them or more, else none is taken for one.

    What stores means stores them in every run; the even harmonics of a rounded triangle look like one.
    """
    found = sum(run.averaged_s > 0.0 for run in runs)
    if 2 * found >= sum(run.has_force for run in runs):
        return tuple(runs)
    return tuple(_as_sampled(run) if run.averaged_s else run for run in runs)


def _as_sampled(run: Run) -> Run:
    notes = tuple(note for note in run.notes if note != note_of(run.averaged_s))
    return replace(run, averaged_s=0.0, notes=notes)


def note_of(window_s: float) -> str:
    """What a run that was stored as moving means says of it."""
    return (
        f"force and motion are moving means over {1e3 * window_s:.4g} ms (nothing is left in them of the "
        f"multiples of {1.0 / window_s:.4g} Hz); models are averaged alike before they are compared"
    )


def sharpened(x: FloatArray, samples: float) -> FloatArray:
    """The signal behind a moving mean, as far as one step of van Cittert goes: noise at most doubles."""
    return x if samples <= 1.0 else 2.0 * x - smoothed(x, samples)


def behind(run: Run) -> Run:
    """The run with the motion that there was before the mean; its force stays as it was stored."""
    if not run.averaged_s:
        return run
    samples = run.averaged_s * run.sample_rate_hz
    return replace(
        run,
        displacement_m=sharpened(run.displacement_m, samples),
        velocity_m_s=sharpened(run.velocity_m_s, samples),
        acceleration_m_s2=sharpened(run.acceleration_m_s2, samples),
    )


def _window(x: FloatArray) -> float:
    """The window in samples of which the channel is a moving mean; 0 for none."""
    start = max(0, (x.size - LOOKED_AT) // 2)
    steps = np.diff(x[start : start + LOOKED_AT])
    top = steps.size // LARGEST_SHARE
    if top <= 2 * SHORTEST or not np.any(steps):
        return 0.0
    size = 1 << int(np.ceil(np.log2(4 * steps.size)))
    power = np.abs(np.fft.rfft(steps * np.hanning(steps.size) ** 2, size)) ** 2
    cepstrum = np.fft.irfft(np.log(power / power.max() + 1e-30))
    windows = np.arange(SHORTEST, top)
    weights = 1.0 / np.array(HARMONICS)
    comb = -weights @ cepstrum[np.outer(HARMONICS, windows)] / float(weights @ weights)
    best = int(windows[np.argmax(comb)])
    others = comb[(windows % best != 0) & (best % windows != 0)]
    found = comb.max() >= LEAST_COMB and comb.max() >= LEAST_CONTRAST * others.max()
    return float(best) if found else 0.0
