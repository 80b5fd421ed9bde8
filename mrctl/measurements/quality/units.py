"""Do the numbers look like SI? Limits are those of real dampers; a unit that a person stated is believed.

A damper moves by less than 1.5 m and 10 m/s (seismic dampers have strokes of 1.2 m, drop towers reach 6 m/s);
its seals and oil do not outlive 150 degC; MR coils take up to about 10 A; the largest MR dampers give some
400 kN, and one of less than 10 N at a speed worth measuring is more likely written in kN, unless others of
its runs show how weak it is.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrctl.measurements.quality.finding import Finding, error, spread, warning
from mrctl.measurements.run import Run

MAX_SPEED_M_S = 10.0
MAX_STROKE_M = 1.5
LONG_STROKE_M, FAST_M_S = 0.3, 3.0
"""Long strokes are slow (seismic dampers, below 2 m/s), fast ones short (drop towers, racing): never both."""
MAX_TEMPERATURE_C, MIN_TEMPERATURE_C, KELVIN_C = 150.0, -60.0, 220.0
MAX_CURRENT_A = 20.0
NOISE_CURRENT_A = 0.05
TURNED_ROUND_A = 0.2  # below zero, that no noise at 0 A reaches
MAX_FORCE_N, MIN_FORCE_N = 1e6, 10.0
WEAK = 0.01  # of the strongest run: no current and a slow motion make no less, kN for N do
WORTH_M_S = 0.02
SLOW_RATE_HZ = 10.0

_MEND = "convert it, or say its unit with --columns MAP.yaml"


def check_units(run: Run, strongest_n: float = 0.0) -> Iterator[tuple[str, Finding]]:
    """Channels whose numbers cannot be SI, each with its finding; strongest_n: a force of another run."""
    for attribute, finding in (*_motion(run), *_force(run, strongest_n), *_current(run), *_temperature(run)):
        if attribute in run.declared:
            yield (
                attribute,
                Finding("warning", finding.file, finding.row, finding.what, "its unit was stated; kept"),
            )
        else:
            yield attribute, finding


def _motion(run: Run) -> Iterator[tuple[str, Finding]]:
    speed, at = _peak(run.velocity_m_s)
    stroke = spread(run.displacement_m)
    if run.sample_rate_hz <= SLOW_RATE_HZ and (
        speed > MAX_SPEED_M_S or stroke > MAX_STROKE_M or len(run) > 1000
    ):
        what = f"time_s steps by {run.dt_s:.3g} s a row: is it in ms?"
        yield "time_s", error(run, 0, what, _MEND)
        return
    measured = "displacement_m" not in run.derived
    if "velocity_m_s" not in run.derived:
        if speed > MAX_SPEED_M_S:
            yield "velocity_m_s", error(run, at, f"velocity_m_s reaches {speed:.4g}: is it in mm/s?", _MEND)
        elif not measured and (stroke > MAX_STROKE_M or (stroke > LONG_STROKE_M and speed > FAST_M_S)):
            what = f"velocity_m_s up to {speed:.4g} makes a stroke of {stroke:.3g} m: is it in mm/s or in/s?"
            yield "velocity_m_s", error(run, at, what, _MEND)
    if measured and stroke > MAX_STROKE_M:
        at = int(np.argmax(np.abs(run.displacement_m)))
        yield "displacement_m", error(run, at, f"displacement_m spans {stroke:.4g}: is it in mm?", _MEND)


def _force(run: Run, strongest_n: float) -> Iterator[tuple[str, Finding]]:
    if not run.has_force:
        return
    peak, at = _peak(run.force_n)
    if peak > MAX_FORCE_N:
        yield "force_n", error(run, at, f"force_N reaches {peak:.4g}: is it in mN?", _MEND)
    elif 0 < peak < MIN_FORCE_N and strongest_n >= MIN_FORCE_N and peak > WEAK * strongest_n:
        what = f"force_N stays within {peak:.4g}, in other runs {strongest_n:.4g}: are they in kN?"
        yield "force_n", warning(run, at, what, f"if so, {_MEND}")
    elif 0 < peak < MIN_FORCE_N and _peak(run.velocity_m_s)[0] > WORTH_M_S:
        yield "force_n", error(run, at, f"force_N stays within {peak:.4g}: is it in kN?", _MEND)
    elif peak == 0:
        yield (
            "force_n",
            error(run, 0, "force_N is zero throughout", "is the load cell connected, the column right?"),
        )


def _current(run: Run) -> Iterator[tuple[str, Finding]]:
    if not run.has_current:
        return
    peak, at = _peak(run.current_a)
    if peak > MAX_CURRENT_A:
        yield "current_a", error(run, at, f"current_A reaches {peak:.4g}: is it in mA?", _MEND)
        return
    low = int(np.argmin(run.current_a))
    least = float(run.current_a[low])
    if least < -NOISE_CURRENT_A:
        mend = "currents count from 0 up: is the clamp turned round, or its zero off?"
        level = error if least < -max(0.1 * peak, TURNED_ROUND_A) else warning
        yield "current_a", level(run, low, f"current_A is negative ({least:.3g})", mend)


def _temperature(run: Run) -> Iterator[tuple[str, Finding]]:
    for attribute, values in (
        ("temperature_c", run.temperature_c),
        ("fluid_temperature_c", run.fluid_temperature_c),
    ):
        if values is None:
            continue
        name = attribute.replace("_c", "_C")
        high, low = int(np.argmax(values)), int(np.argmin(values))
        if values[low] > KELVIN_C:
            yield attribute, error(run, low, f"{name} is {values[low]:.4g}: is it in kelvin?", _MEND)
        elif values[high] > MAX_TEMPERATURE_C:
            yield attribute, error(run, high, f"{name} reaches {values[high]:.4g}: is it in degF?", _MEND)
        elif values[low] < MIN_TEMPERATURE_C:
            what = f"{name} is {values[low]:.4g}: a broken thermocouple?"
            yield attribute, error(run, low, what, "put in the true temperature, or a constant in the map")


def _peak(values: np.ndarray) -> tuple[float, int]:
    """The largest magnitude and where it is."""
    at = int(np.argmax(np.abs(values)))
    return float(abs(values[at])), at
