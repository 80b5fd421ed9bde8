"""Figs. 9.9 to 9.14: Spencer's damper beside the models of it."""

from __future__ import annotations

import numpy as np

from mrctl.report.series import Panel, Series
from mrctl.verify.hysteresis import convergence, fir_and_iir
from mrctl.verify.picture import Picture, over_time
from mrctl.verify.spencer import Case, SpencerResult, Trace


def pictures(found: SpencerResult) -> list[Picture]:
    """The published figures, and the better method's errors over voltage and speed."""
    name = f"{found.volts:g} V"
    both = {"paper": found.paper, "best": found.best}
    truth = found.best
    over_t = [
        over_time("Spencer's damper", truth.time_s, truth.wanted_n),
        *(over_time(m, t.time_s, t.force_n) for m, t in both.items()),
    ]
    over_v = [
        over_time("Spencer's damper", truth.velocity_m_s, truth.wanted_n),
        *(over_time(m, t.velocity_m_s, t.force_n) for m, t in both.items()),
    ]
    newtons = [over_time(m, t.time_s, t.miss_n) for m, t in both.items()]
    percent = [over_time(m, t.time_s, t.percent) for m, t in both.items()]
    level = np.array([r.current_a for r in found.steps.preparation.records])
    return [
        Picture(
            "Fig. 9.9",
            f"Spencer's force and the models', {name}",
            "Time (s)",
            (Panel("Force (N)", over_t),),
            "lie on one another",
        ),
        Picture(
            "Fig. 9.10",
            "their errors",
            "Time (s)",
            (Panel("Error (N)", newtons),),
            "very good most of the time, with periodic spikes",
        ),
        Picture(
            "Fig. 9.11",
            "the same in percent of the largest force",
            "Time (s)",
            (Panel("Error (%)", percent),),
            "spikes of 6.2 to 8.2 and of -8 to -10 %, within 1 % between them",
        ),
        Picture(
            "Fig. 9.12",
            f"force over velocity, {name}",
            "Velocity (m/s)",
            (Panel("Force (N)", over_v),),
            "Spencer's force turns more abruptly near 5 cm/s than the model's",
            kind="loop",
        ),
        convergence("Fig. 9.13", found.steps, level, "the FIR filter has converged", "V"),
        fir_and_iir("Fig. 9.14", found.steps, "the IIR filter approximates the FIR filter"),
        _over_voltage_and_speed(found),
    ]


def _over_voltage_and_speed(found: SpencerResult) -> Picture:
    speeds = sorted({round(case.speed_m_s, 3) for case, _ in found.singles})
    curves = [
        _curves(f"{speed:.2g} m/s", [one for one in found.singles if abs(one[0].speed_m_s - speed) < 1e-3])
        for speed in speeds
    ]
    curves.append(_curves("one calibration", list(found.together), dashed=True))
    return Picture(
        "Sec. 9.3",
        "error of the better method over voltage and speed",
        "Voltage (V)",
        (
            Panel("RMS error (%)", [rms for rms, _ in curves], height=150.0),
            Panel("Largest error (%)", [peak for _, peak in curves], height=150.0),
        ),
        note=(
            "By speed: identified from each run, with `gas_spring`. Dashed: one calibration for all "
            "voltages of the published motion."
        ),
    )


def _curves(label: str, ones: list[tuple[Case, Trace]], *, dashed: bool = False) -> tuple[Series, Series]:
    volts = [case.volts for case, _ in ones]
    return (
        Series(label, volts, [t.rms for _, t in ones], dashed=dashed),
        Series(label, volts, [t.peak for _, t in ones], dashed=dashed),
    )
