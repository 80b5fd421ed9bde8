"""Sensors that stop telling the truth: clipped at the end of their range, or stuck."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrctl.measurements.derivative import noise_sigma
from mrctl.measurements.quality.finding import Finding, error, spread, stretches, warning
from mrctl.measurements.run import FloatArray, Run

FLAT_ROWS = 4
FLAT_TOTAL = 8
FLAT_RATIO = 0.6
"""Of the samples near an extreme, those *at* it: nearly all where it is clipped, at most sqrt(1/6) = 0.41 at
a sine's top, which with a coarse converter is as flat as a sixth of the depth looked at."""
NEAR_SHARE, NEAR_QUANTA = 0.003, 5.0
SHARP, NOISE_FREE = 1e-5, 1e-5
STUCK_ROWS = 10
STUCK_CHANGE = 0.2


def measured_channels(run: Run) -> Iterator[tuple[str, str, FloatArray]]:
    """Attribute, column and samples of the force and the motion, as far as they were measured."""
    for attribute, name in (
        ("force_n", "force_N"),
        ("velocity_m_s", "velocity_m_s"),
        ("displacement_m", "displacement_m"),
    ):
        if attribute not in run.derived and (attribute != "force_n" or run.has_force):
            yield attribute, name, getattr(run, attribute)


def check_clipping(run: Run) -> Iterator[Finding]:
    """Flat tops and bottoms with sharp edges, in force and the measured motion."""
    for attribute, name, values in measured_channels(run):
        if spread(values) == 0:
            continue
        tops = [(sign, *flat) for sign in (1.0, -1.0) if (flat := _flat_top(sign * values)) is not None]
        rows = sum(top[2] for top in tops)
        if not tops or rows > 0.9 * len(run) or (attribute == "velocity_m_s" and rows > 0.3 * len(run)):
            continue  # a square wave of force, a triangle of displacement: meant so
        _, first, _ = min(tops, key=lambda top: top[1])
        levels = " and ".join(f"{top[0] * np.max(top[0] * values):.6g}" for top in tops)
        what = f"{name} looks clipped: it stays at exactly {levels} in {rows} rows"
        mend = "raise the range of the sensor, or remove the run"
        # Data without any noise come from a model, and a model's table may well end in a flat line.
        clean = noise_sigma(_moving(values)) < NOISE_FREE * spread(values)
        yield (warning if clean else error)(run, first, what, mend)


def _moving(values: FloatArray) -> FloatArray:
    """The longest stretch between flat tops and bottoms."""
    low, high = values.min(), values.max()
    start, end = max(
        stretches((values > low) & (values < high)), key=lambda part: part[1] - part[0], default=(0, 0)
    )
    return values[start:end]


def _flat_top(values: FloatArray) -> tuple[int, int] | None:
    """First sample and number of samples at the very top, if the top looks cut off."""
    top, span = float(values.max()), spread(values)
    quantum = _quantum(np.abs(np.diff(values)), span)
    flat = values >= top - min(0.5 * quantum, 1e-9 * span)
    near = values >= top - max(NEAR_SHARE * span, NEAR_QUANTA * min(quantum, 0.05 * span))
    runs = [(start, end) for start, end in stretches(flat) if end - start >= FLAT_ROWS]
    count = sum(end - start for start, end in runs)
    if count < FLAT_TOTAL or count < FLAT_RATIO * int(np.count_nonzero(near)):
        return None
    if len(runs) < 2 and count < 3 * FLAT_TOTAL:
        return None
    # A curve that flattens out by itself (a saturating tanh, down to the last bit) has no edge; a clipped one
    # has.
    edges = [values[end] - values[end + 1] for _, end in runs if end + 1 < len(values)]
    edges += [values[start - 1] - values[start - 2] for start, _ in runs if start >= 2]
    if not edges or float(np.median(edges)) < SHARP * span:
        return None
    return runs[0][0], count


def _quantum(steps: FloatArray, span: float) -> float:
    """The smallest step between neighbours: the resolution, where a converter is coarse."""
    steps = steps[steps > 1e-12 * span]
    return float(steps.min()) if len(steps) else 0.0


def check_stuck(run: Run) -> Iterator[Finding]:
    """Channels that stay at exactly one value while the other, force or velocity, goes on changing."""
    if not run.has_force:
        return
    pairs = (("force_n", "force_N", run.velocity_m_s), ("velocity_m_s", "velocity_m_s", run.force_n))
    for attribute, name, other in pairs:
        if attribute in run.derived:
            continue
        values: FloatArray = getattr(run, attribute)
        span = spread(values)
        if span == 0:
            if attribute == "force_n" and spread(other) > 0 and np.any(values):
                yield error(run, 0, f"{name} never changes", "is the sensor connected, the column right?")
            continue
        steps = np.abs(np.diff(values))
        quantum, ends = _quantum(steps, span), {float(values.min()), float(values.max())}
        for start, last in stretches(steps == 0):
            # At the ends of the range it is clipped, not stuck; a coarse converter goes on to the next level.
            if last - start < STUCK_ROWS or float(values[start]) in ends:
                continue
            if last < len(steps) and steps[last] < 3 * quantum:
                continue
            if spread(other[start : last + 1]) > STUCK_CHANGE * spread(other):
                rows = last - start + 1
                what = f"{name} is stuck at {values[start]:.6g} for {rows} rows while the rest goes on"
                yield error(run, start, what, "cut the stretch out, or remove the run")
                break
