"""Sec. 9.3: Spencer's damper (Eq. 9.1 to 9.3), characterised by both methods.

As published, the damper is characterised in a motion and compared in it. Beyond that, one calibration is
asked to hold for all voltages of the motion. Errors are over whole cycles, in percent of the run's largest
force: the better method's against the damper's true force, without the load cell's noise; the published
method's against the filtered force that it is fitted to, as in Ch. 7.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.refit import fitted
from mrctl.identify.best import identify_best
from mrctl.identify.finish import damper_of
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.paper import identify_paper
from mrctl.identify.paper.identify import PaperSteps
from mrctl.identify.paper.validation import backbone_over_time, filtered
from mrctl.identify.records import records_of
from mrctl.measurements.run import Campaign
from mrctl.model.baselines.bouc_wen import SPENCER_1997
from mrctl.model.effects.registry import effect
from mrctl.plant.dyno.campaign import Bench, DynoRun
from mrctl.simulate import simulate
from mrctl.verify.entries import Entry, Span

Array = NDArray[np.float64]
Report = Callable[[float, str], None]

PROTOCOL = "eq-9.4"
SHOWN_V = 1.35  # the run of the figures: the middle of the prototype's range
SETTLED = (2, 1)  # cycles left out at the start and the end
CYCLES = 8
NEIGHBOURS = 2  # the published method needs two currents: the shown voltage and the next
ACCUMULATOR = ("gas_spring",)  # Spencer's spring k1, which one voltage shows already
# What several voltages show beside it: the dashpot c1 in series; the dashpot c0, which no voltage scales, so
# that the force bends less without one.
EFFECTS = ("mount_compliance", "viscous_damping", "gas_spring", "off_state_backbone")
BEGIN = {"mount_compliance": (1e-5, 2e4)}  # where the series element carries motion: else it stays rigid
SPIKES = 90.0  # percent of the time that counts as between spikes


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A run of Spencer's damper and its true force; kept: the settled cycles."""

    item: DynoRun
    kept: slice

    @property
    def volts(self) -> float:
        """What it is commanded."""
        return float(self.item.run.current_a[0])

    @property
    def speed_m_s(self) -> float:
        """The motion's largest."""
        return float(np.max(np.abs(self.item.drive.motion.velocity_m_s)))


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A method's force beside the one that it is held against; the kept samples of a run."""

    time_s: Array
    velocity_m_s: Array
    wanted_n: Array
    force_n: Array

    @property
    def miss_n(self) -> Array:
        """The error in N."""
        return self.force_n - self.wanted_n

    @property
    def percent(self) -> Array:
        """The error in percent of the largest force."""
        return np.asarray(100.0 * self.miss_n / np.max(np.abs(self.wanted_n)), dtype=np.float64)

    @property
    def rms(self) -> float:
        """Its root mean square."""
        return float(np.sqrt(np.mean(self.percent**2)))

    @property
    def peak(self) -> float:
        """Its largest."""
        return float(np.max(np.abs(self.percent)))


@dataclass(frozen=True, slots=True, eq=False)
class SpencerResult:
    """The lines, and what the figures show: one run by both methods, all runs by the better one.

    singles: each run identified from itself; together: one calibration for the published motion.
    """

    entries: tuple[Entry, ...]
    steps: PaperSteps
    volts: float
    paper: Trace
    best: Trace
    singles: tuple[tuple[Case, Trace], ...]
    together: tuple[tuple[Case, Trace], ...]


def spencer(seed: int = 1, report: Report = lambda _share, _what: None) -> SpencerResult:
    """Measure Spencer's damper in the published motion, slower ones too, and characterise it."""
    cases = _cases(seed)
    top = max(case.speed_m_s for case in cases)
    published = [case for case in cases if case.speed_m_s > 0.99 * top]
    shown = min(published, key=lambda case: abs(case.volts - SHOWN_V))
    near = sorted(published, key=lambda case: abs(case.volts - shown.volts))[:NEIGHBOURS]
    report(0.0, "Spencer's damper, the published method")
    steps = identify_paper(_campaign(near)).steps
    by_paper = _by_paper(steps, near.index(shown))
    plain, singles = {}, {}
    for k, case in enumerate(cases):
        name = case.item.run.name
        report(0.05 + 0.65 * k / len(cases), f"Spencer's damper, {name}")
        base = identify_best(_campaign([case])).fit
        plain[name] = (case, _trace(base, case))
        singles[name] = (case, _trace(_with(base, [case], ACCUMULATOR), case))
    report(0.7, "Spencer's damper, all voltages at once")
    base = identify_best(_campaign(published)).fit
    bare = [_trace(base, case) for case in published]
    together = _with(base, published, EFFECTS)
    whole = [_trace(together, case) for case in published]
    report(1.0, "Spencer's damper")

    def where(found: dict[str, tuple[Case, Trace]], *, fast: bool) -> list[Trace]:
        return [trace for case, trace in found.values() if (case.speed_m_s > 0.99 * top) == fast]

    lines = (
        ("identified from the same run, 0 to 2.25 V, base model", where(plain, fast=True), False),
        (f"identified from the same run with {ACCUMULATOR[0]}, 0 to 2.25 V", where(singles, fast=True), True),
        ("the same at a quarter, a half and three quarters of the speed", where(singles, fast=False), True),
        ("one calibration for all six voltages, base model", bare, False),
        (f"one calibration for all six voltages with {', '.join(EFFECTS)}", whole, True),
    )
    by_best = singles[shown.item.run.name][1]
    return SpencerResult(
        (*_shown_lines(by_paper, by_best), *(e for line in lines for e in _largest(*line))),
        steps,
        shown.volts,
        by_paper,
        by_best,
        tuple(singles.values()),
        tuple((case, trace) for case, trace in zip(published, whole, strict=True)),
    )


def _cases(seed: int) -> list[Case]:
    cases = []
    for item in Bench(SPENCER_1997, seed=seed).runs(PROTOCOL):
        n = len(item.run)
        cases.append(Case(item, slice(n * SETTLED[0] // CYCLES, n * (CYCLES - SETTLED[1]) // CYCLES)))
    return cases


def _campaign(cases: Sequence[Case]) -> Campaign:
    return Campaign(cases[0].item.run.file.parent, tuple(case.item.run for case in cases), "0" * 64)


def _with(base: JointFit, cases: Sequence[Case], names: Sequence[str]) -> JointFit:
    """The fit with effects, at the runs' full rate: what it is wanted for is the turn at each reversal."""
    chosen = [effect(name) for name in names]
    begin = {one.name: BEGIN.get(one.name, one.typical) for one in chosen}
    return fitted(records_of([case.item.run for case in cases]), chosen, begin, start=base)


def _trace(fit: JointFit, case: Case) -> Trace:
    """The better method's force beside the damper's true one."""
    run, motion, kept = case.item.run, case.item.drive.motion, case.kept
    force = simulate(
        damper_of(fit),
        run.dt_s,
        run.velocity_m_s,
        run.current_a,
        run.temperature_c,
        run.displacement_m,
        run.acceleration_m_s2,
    )
    time: Array = np.arange(len(run), dtype=np.float64) * run.dt_s
    return Trace(time[kept], motion.velocity_m_s[kept], case.item.truth.force_n[kept], force[kept])


def _by_paper(steps: PaperSteps, place: int) -> Trace:
    """The published method's force beside the filtered one."""
    record = next(r for r in steps.preparation.records if r.run == place)
    force = filtered(steps.lower_order.iir, backbone_over_time(record, steps.tables))
    time = record.time_s - record.time_s[0]
    return Trace(*(record.cut(x) for x in (time, record.velocity_m_s, record.force_n, force)))


def _shown_lines(paper: Trace, best: Trace) -> list[Entry]:
    both = {"paper": paper.percent, "best": best.percent}
    what = "12 pi cos(5 pi t) cm/s, 1.35 V"
    return [
        Entry(
            "Fig. 9.11",
            f"{what}, largest positive error",
            "%",
            "6.2 to 8.2",
            {m: float(np.max(e)) for m, e in both.items()},
        ),
        Entry(
            "Fig. 9.11",
            f"{what}, largest negative error",
            "%",
            "8 to 10",
            {m: float(-np.min(e)) for m, e in both.items()},
        ),
        Entry(
            "Fig. 9.11",
            f"{what}, between the spikes (nine tenths of the time), largest",
            "%",
            "1",
            {m: float(np.percentile(np.abs(e), SPIKES)) for m, e in both.items()},
        ),
    ]


def _largest(what: str, found: list[Trace], asked: bool) -> list[Entry]:  # noqa: FBT001 - a row of a table
    """The largest RMS and peak of some runs."""
    goals = ({"best": Span(0.0, 1.0)}, {"best": Span(0.0, 4.0)}) if asked else ({}, {})
    rms, peak = {"best": max(t.rms for t in found)}, {"best": max(t.peak for t in found)}
    return [
        Entry("Sec. 9.3", f"{what}: RMS, largest", "%", "-", rms, goals[0]),
        Entry("Sec. 9.3", f"{what}: peak, largest", "%", "6 to 10", peak, goals[1]),
    ]
