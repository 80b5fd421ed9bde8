"""What a campaign could not tell, in plain words, and what to measure for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base
from mrctl.identify.finish import FAR_APART_C, NEAR_ZERO_A
from mrctl.identify.hysteresis import as_filter
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record
from mrctl.model.damper import Damper
from mrctl.model.filters import BAND_HZ

Array = NDArray[np.float64]

STEADY_A = 0.05  # a current that moves less than this in every run shows no lag
UNEVEN_SHARE = 0.7  # of the larger top speed that the smaller one must reach
HARMONIC_SHARE = 1e-4  # of the static force's power at which a frequency counts as excited
LONGEST_LIST = 2  # currents in a row that are named one by one
OTHER_FILTER = 0.02  # of its response up to 20 Hz, that the filter written may be off without a word
VAGUE_SHARE = 0.05  # relative standard deviation above which a table value is called vague


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that the data does not say: what it is about, what was taken instead, what to measure."""

    part: str
    what: str
    measure: str

    def __str__(self) -> str:
        """`PART: WHAT; to know, MEASURE`."""
        return f"{self.part}: {self.what}; to know, {self.measure}"


def findings_of(fit: JointFit, std: dict[str, tuple[float, ...]], damper: Damper) -> tuple[Finding, ...]:
    """All that the campaign could not identify, and what of the fit the damper made of it does not hold."""
    parts = _current(fit, std), _velocity(fit), _temperature(fit), _filter(fit), _carried(fit, damper)
    return tuple(finding for part in parts for finding in part)


def _current(fit: JointFit, std: dict[str, tuple[float, ...]]) -> list[Finding]:
    i, f = fit.model.layout.current_a, fit.tables.f
    found = []
    if i[0] >= NEAR_ZERO_A:
        found.append(
            Finding(
                "f",
                f"no run below {i[0]:.3g} A: the force at 0 A is extrapolated",
                "measure at 0 A, as hot and cold",
            )
        )
    if i.size == 1:
        what = (
            "one current only: taken as the same at all currents"
            if i[0] < NEAR_ZERO_A
            else "one current only"
        )
        found.append(Finding("f", what, "measure at three currents or more, up to the largest in use"))
        return found
    if i.size == 2:
        found.append(
            Finding("f", "two currents only: straight between them", "measure at a current in between")
        )
    if fit.model.layout.two_states and not fit.model.layout.free_blend:
        found.append(
            Finding(
                "transition",
                f"nothing measured between {i[0]:.3g} and {i[1]:.3g} A: h goes over linearly there",
                f"measure at {0.5 * (i[0] + i[1]):.2g} A, hot and cold",
            )
        )
    relative = np.array(std["f.force"][-i.size :]) / np.maximum(f, 1e-9)
    vague = _stretches(i, relative > VAGUE_SHARE)
    if vague:
        found.append(
            Finding("f", f"known to no better than 5 % at {', '.join(vague)}", "measure longer there")
        )
    return found


def _stretches(current_a: Array, chosen: NDArray[np.bool_]) -> list[str]:
    """The chosen currents (n), rising, in words: three or more in a row by their ends."""
    found: list[str] = []
    at = np.flatnonzero(chosen)
    for row in np.split(current_a[at], np.flatnonzero(np.diff(at) > 1) + 1):
        if row.size > LONGEST_LIST:
            found.append(f"{row[0]:.3g} to {row[-1]:.3g} A")
        else:
            found += [f"{a:.3g} A" for a in row]
    return found


def _velocity(fit: JointFit) -> list[Finding]:
    speeds = np.concatenate([r.velocity_m_s for r in fit.model.records])
    up, down = float(speeds.max()), float(-speeds.min())
    found = []
    if min(up, down) < UNEVEN_SHARE * max(up, down):
        side, low = ("compression", down) if down < up else ("extension", up)
        found.append(
            Finding(
                "g",
                f"{side} was seen up to {max(low, 0.0):.3g} m/s only, beyond that it mirrors the other side",
                f"measure {side} up to {max(up, down):.3g} m/s",
            )
        )
    found.append(
        Finding("g", f"constant beyond {max(up, down):.3g} m/s", "measure up to the largest velocity in use")
    )
    return found


def _temperature(fit: JointFit) -> list[Finding]:
    layout = fit.model.layout
    measure = "measure the same motion cold and hot, with and without current"
    if layout.temperature_c.size == 1:
        return [
            Finding("h", f"one temperature only ({layout.temperature_c[0]:.0f} degC): taken as 1", measure)
        ]
    found = _between(layout.temperature_c)
    if not layout.two_states:
        off = bool(layout.current_a[0] < NEAR_ZERO_A)
        which, other = ("on", "off") if off else ("off", "on")
        return [Finding("h", f"no run in the {which} state: taken as in the {other} state", measure), *found]
    unseen = ", ".join(f"{x:.0f}" for x in layout.temperature_c[layout.off_unseen])
    if unseen:
        what = f"nothing measured without current near {unseen} degC: taken much as with current"
        found.append(Finding("h", what, f"measure at {layout.current_a[0]:.2g} A at {unseen} degC too"))
    return found


def _between(temperature_c: Array) -> list[Finding]:
    gaps = [(low, high) for low, high in pairwise(temperature_c) if high - low > FAR_APART_C]
    return [
        Finding(
            "h",
            f"nothing measured between {low:.0f} and {high:.0f} degC: taken to change by one share a degree",
            f"measure the same motion near {0.5 * (low + high):.0f} degC",
        )
        for low, high in gaps
    ]


def _carried(fit: JointFit, damper: Damper) -> list[Finding]:
    written = damper.forward_filter
    exact = as_filter(fit.tables.filter, written.sample_rate_hz)
    f = np.linspace(0.2, BAND_HZ, 100)
    off = float(np.max(np.abs(written.response(f) / exact.response(f) - 1.0)))
    if off < OTHER_FILTER:
        return []
    what = (
        f"the filter that fits best cannot run at 500 Hz: the one written is off by up to {100 * off:.2g} %"
    )
    return [
        Finding("H", what, "look for a load cell that drifts or is struck, and measure at 500 Hz or faster")
    ]


def _filter(fit: JointFit) -> list[Finding]:
    low, high = excited_band_hz(fit)
    found = []
    if steady(fit.model.records):
        found.append(
            Finding(
                "current", "steady in every run: how fast it acts is not seen", "measure steps of current"
            )
        )
    if high < 20.0:
        found.append(
            Finding(
                "H", f"little force above {high:.2g} Hz: the filter is a guess there", "measure faster motion"
            )
        )
    if low > 1.0:
        found.append(
            Finding(
                "H",
                f"nothing below {low:.2g} Hz: the static force is only known through the filter",
                "measure slower motion too, 0.1 to 0.5 Hz",
            )
        )
    strokes = {round(float(np.ptp(r.displacement_m)), 3) for r in fit.model.records}
    if len(strokes) == 1 and len(fit.model.records) > 1:
        found.append(
            Finding(
                "motion",
                "one motion only: effects of stroke, speed and acceleration cannot be told apart",
                "measure at other frequencies and amplitudes",
            )
        )
    return found


def steady(records: Sequence[Record]) -> bool:
    """Whether the current is steady in every one of them."""
    return all(float(np.ptp(r.current_a)) < STEADY_A for r in records)


def excited_band_hz(fit: JointFit) -> tuple[float, float]:
    """The lowest and highest frequency in Hz at which the static force of any record has power."""
    low, high = np.inf, 0.0
    for record, inputs in zip(fit.model.records, fit.model.inputs, strict=True):
        u = base.backbone(inputs, fit.tables).force_n
        n = u.size
        power = np.abs(np.fft.rfft((u - u.mean()) * np.hanning(n))) ** 2
        hz = np.fft.rfftfreq(n, 1.0 / record.rate_hz)
        seen = hz[power > HARMONIC_SHARE * power.max()]
        low, high = min(low, float(seen[0])), max(high, float(seen[-1]))
    return low, high
