"""Do the channels belong to one damper? The sign of force, and motion that agrees with itself."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

from mrctl.measurements.integral import hann_line, integrate
from mrctl.measurements.quality.finding import Finding, error, inner, spread, warning
from mrctl.measurements.run import FloatArray, Run

FLIPPED = -0.3
SCALE_ERROR, SCALE_WARNING = 0.2, 0.05
FACTORS = {1000.0: "mm", 100.0: "cm", 25.4: "inch", 39.3701: "inch", 9.80665: "g"}


def check_sign(run: Run) -> Iterator[Finding]:
    """Force that works in the direction of motion: a damper takes energy, whatever spring or friction it has.

    Springs, gas, preload and inertia do no work over a cycle, friction and hysteresis take some, and a delay
    of 5 ms still leaves cos(2 pi f tau) > 0.8 at 20 Hz: only a turned sign makes the correlation strongly
    negative.
    """
    if not run.has_force:
        return
    force, velocity = run.force_n - run.force_n.mean(), run.velocity_m_s - run.velocity_m_s.mean()
    size = sqrt(inner(force, force) * inner(velocity, velocity))
    if size == 0:
        return
    correlation = inner(force, velocity) / size
    if correlation < FLIPPED:
        what = f"force and velocity have opposite signs (correlation {correlation:.2f}): is the sign flipped?"
        mend = "turn one of them: `sign: -1` in --columns MAP.yaml; force > 0 resists extension, velocity > 0"
        yield error(run, None, what, mend)
    elif inner(run.force_n, run.velocity_m_s) < 0 and correlation < 0:
        what = "the damper gives out energy: force and velocity hardly go together"
        yield warning(run, None, what, "check signs and the delay between the channels")


def check_consistency(run: Run) -> Iterator[Finding]:
    """Measured displacement, velocity and acceleration against each other's integrals.

    Noise of the one makes a slope too small, noise of the other too large: what a slope of either on the
    other leaves open is no wrong scale.
    """
    pairs = (
        ("displacement_m", "velocity_m_s", run.displacement_m, run.velocity_m_s),
        ("velocity_m_s", "acceleration_m_s2", run.velocity_m_s, run.acceleration_m_s2),
    )
    for name, rate_name, level, rate in pairs:
        if name in run.derived or rate_name in run.derived or spread(level) == 0 or spread(rate) == 0:
            continue
        expected = integrate(rate, run.dt_s).values
        slope, correlation = _compare(level, expected)
        if correlation < -0.5:
            what = f"{name} and {rate_name} have opposite signs"
            yield error(run, None, what, "turn one of them: `sign: -1` in --columns MAP.yaml")
        elif correlation < 0.9:
            what = f"{name} and {rate_name} do not belong together (correlation {correlation:.2f})"
            yield warning(run, None, what, "leave one of them out, and it is derived from the other")
        elif (off := max(slope - 1.0, 1.0 - slope / correlation**2)) > SCALE_WARNING:
            what = f"{name} is {slope / correlation:.4g} times what {rate_name} adds up to{_guess(slope)}"
            level_of = error if off > SCALE_ERROR else warning
            mend = "correct unit or scale of one of them in --columns MAP.yaml, or leave it out"
            yield level_of(run, None, what, mend)


def _compare(level: FloatArray, expected: FloatArray) -> tuple[float, float]:
    """Slope and correlation of two signals, each without its straight line."""
    left, right = level - hann_line(level), expected - hann_line(expected)
    cross, power, other = inner(left, right), inner(right, right), inner(left, left)
    if power == 0 or other == 0:
        return 1.0, 1.0
    return cross / power, cross / sqrt(power * other)


def _guess(slope: float) -> str:
    """The unit that a factor speaks of."""
    for factor, unit in FACTORS.items():
        if abs(slope / factor - 1) < 0.05 or abs(slope * factor - 1) < 0.05:
            return f": is one of them in {unit}?"
    return ""
