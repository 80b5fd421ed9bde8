"""Is there enough, at an even pace? Time, finite values, length, samples per cycle, motion at all."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrctl.measurements.clock import JITTER
from mrctl.measurements.integral import motion_frequency
from mrctl.measurements.quality.finding import Finding, error, inner, stretches, warning
from mrctl.measurements.run import CHANNELS, FloatArray, Run

MIN_ROWS = 50
"""A third-order filter and its start-up take about this many samples before they say anything."""
POOR_SAMPLES, FEW_SAMPLES = 8, 20
"""Samples a cycle: a sine's peak is missed by up to 1 - cos(pi / n), 8 % at 8 samples, 1.2 % at 20."""
STILL_M_S = 1e-4
STILL_SHARE = 0.05
STILL_SECONDS = 0.5


def check_clock(run: Run) -> Iterator[Finding]:
    """Defects after which nothing else can be judged."""
    for channel in CHANNELS:
        values = getattr(run, channel.attribute)
        if values is None or (channel.attribute in {"force_n", "current_a"} and np.isnan(values).all()):
            continue
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            what = f"{channel.column} is not finite in {len(bad)} rows"
            yield error(run, int(bad[0]), what, "fill in the values, or remove the rows")
    steps = np.diff(run.time_s)
    step = float(np.median(steps)) if len(steps) else 0.0
    for index in np.flatnonzero(steps <= 0)[:1]:
        word = "stands still" if steps[index] == 0 else "goes backwards"
        yield error(run, int(index) + 1, f"time {word} at {run.time_s[index]:.9g} s", "put the rows in order")
    for index in np.flatnonzero(steps > (1.5 + JITTER) * step)[:1]:
        what = f"a gap: no samples from {run.time_s[index]:.9g} to {run.time_s[index + 1]:.9g} s"
        yield error(run, int(index) + 1, what, "split the file at the gap")
    if len(run) < MIN_ROWS:
        yield error(
            run, None, f"too short: {len(run)} rows", f"record {MIN_ROWS} at least, better several cycles"
        )


def check_motion(run: Run) -> Iterator[Finding]:
    """Too little motion, too short, or too few samples of it."""
    velocity = run.velocity_m_s
    peak = float(np.max(np.abs(velocity)))
    if float(np.sqrt(np.mean(velocity**2))) < STILL_M_S:
        yield error(run, None, f"no motion: velocity stays below {peak:.2g} m/s", "remove the run")
        return
    frequency = motion_frequency(velocity, run.dt_s)
    if frequency is None:
        what = "less than one cycle of motion: drift and damping cannot be told apart well"
        yield warning(run, None, what, "record several cycles")
        return
    centred = velocity - velocity.mean()
    neighbours = inner(centred[1:], centred[:-1]) / inner(centred, centred)
    samples = run.sample_rate_hz / frequency
    if samples < POOR_SAMPLES or neighbours < 0.3:
        if _one_tone(centred):
            what = f"the sample rate is too low: {samples:.1f} samples a cycle of {frequency:.3g} Hz"
            yield error(
                run, None, what, f"sample at {FEW_SAMPLES * frequency:.3g} Hz or more; is time_s in ms?"
            )
        else:
            what = "velocity is noise only: neighbouring samples have little in common"
            yield error(run, None, what, "is it the right column? else remove the run")
        return
    if round(samples) < FEW_SAMPLES:
        what = f"the sample rate is low: {samples:.1f} samples a cycle of {frequency:.3g} Hz"
        yield warning(run, None, what, f"better sample at {FEW_SAMPLES * frequency:.3g} Hz or more")
    yield from _silent(run, frequency)


def _one_tone(centred: FloatArray) -> bool:
    """Whether most of the power stands in a few neighbouring bins."""
    power = np.abs(np.fft.rfft(centred * np.hanning(len(centred)))) ** 2
    peak = int(np.argmax(power))
    return bool(power[max(0, peak - 3) : peak + 4].sum() > 0.5 * power.sum())


def _silent(run: Run, frequency: float) -> Iterator[Finding]:
    """Stretches without motion, longer than half a second and half a cycle."""
    least = max(STILL_SECONDS, 0.5 / frequency)
    window = max(3, int(0.25 * least * run.sample_rate_hz))
    if window >= len(run) // 2:
        return
    power = np.convolve(run.velocity_m_s**2, np.full(window, 1.0 / window), mode="same")
    still = list(stretches(power < STILL_SHARE**2 * power.max()))
    long = [(start, end) for start, end in still if (end - start) * run.dt_s >= least]
    if not long:
        return
    first, last = long[0]
    rows = sum(end - start for start, end in long)
    more = f" and {len(long) - 1} more stretches" if len(long) > 1 else ""
    what = (
        f"no motion in rows {run.row(first)} to {run.row(last - 1)}{more} "
        f"({100 * rows / len(run):.0f} % of the run)"
    )
    yield warning(
        run, first, what, "harmless, but it dilutes mean errors: cut it off if the run is to be judged"
    )
