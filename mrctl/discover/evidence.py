"""What a diagnosis works on: records at a rate that can be searched, their noise, the base model's fit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.base_fit import base_fit, fitted_to, stepless
from mrctl.discover.channels.current_clock import LEAST_S, MOST_S, current_late_s, earlier
from mrctl.discover.channels.load_cell import LoadCell
from mrctl.discover.channels.run_gains import run_gains
from mrctl.discover.channels.run_zeros import run_zeros
from mrctl.discover.channels.runs_own import RunsOwn
from mrctl.discover.channels.sharpened import Smoothing, smoothing_of
from mrctl.discover.channels.step_times import timed, without_steps
from mrctl.discover.fits.folds import folds_of
from mrctl.discover.fits.grow import Folds
from mrctl.discover.fits.proof import Proof, prove
from mrctl.discover.fits.screen import ranges_of
from mrctl.discover.fits.searched import at_search_rates, unresolved
from mrctl.discover.noise.budget import Budget, budget_of
from mrctl.discover.noise.input_noise import input_noise, steadied
from mrctl.discover.noise.motion_noise import Spectrum, noise_spectrum
from mrctl.discover.noise.noise_floor import NoiseFloor, noise_floor
from mrctl.discover.noise.rest import stilled
from mrctl.discover.noise.spectral_floor import mean_square
from mrctl.errors import InputError
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.processes import in_processes
from mrctl.identify.records import Record, records_of
from mrctl.identify.run_scatter import FEWEST_RUNS
from mrctl.measurements.run import Campaign
from mrctl.model.effects.base import Effect
from mrctl.model.effects.registry import effects
from mrctl.model.effects.size import sized

Array = NDArray[np.float64]

REST_M_S = 1e-4
MOVED_M = 1e-5
DOUBLINGS = 2  # of the rate, at most
WHOLE = 0.95  # of the seconds measured, for a search to have seen them all
LATE_AROUND = 3  # samples more and less, that a current is tried to be late by
CLOSE_TO_NOISE = 2.0  # in mean square, for what a fit misses in the mean to be a load cell's zeros


@dataclass(frozen=True, eq=False)
class Evidence:
    """The campaign's moving runs: at full rate, at the rate of the search, with noise floors and folds."""

    campaign: Campaign
    measured: list[Record]
    full: list[Record]
    records: list[Record]
    floors: list[NoiseFloor]
    folds: Folds
    motion_noise: Spectrum | None
    cell: LoadCell  # taken off the runs' forces
    times: tuple[int, ...] = ()  # the usual rate of the search, that a record's is; none: all at that
    current_late_s: float = 0.0  # taken off the current's clock
    smoothing: Smoothing | None = None  # of the velocities, that was undone
    centres_m: tuple[float, ...] = ()  # by how much strokes that were integrated were moved, by record
    rests_s: tuple[float, ...] = ()  # in which each record rests, what was cut off it too

    @classmethod
    def of(cls, campaign: Campaign) -> Evidence:
        """Raises InputError when no run moves the damper and measures its force."""
        moving = [
            r
            for r in records_of(campaign.runs)
            if float(np.max(np.abs(r.velocity_m_s))) > REST_M_S and float(np.ptp(r.force_n)) > 0.0
        ]
        if not moving:
            raise InputError.at(
                campaign.root,
                "no run moves the damper and measures its force",
                "measure velocity and force in motion",
            )
        floors = in_processes(lambda r: noise_floor(campaign.runs[r.run]), moving)
        noise = noise_spectrum(moving)
        still, rests_s = zip(*(stilled(r, noise) for r in moving), strict=True)
        found = cls._of(campaign, list(still), floors, noise, LoadCell.true(len(still)))
        return replace(found, rests_s=rests_s)

    @classmethod
    def _of(
        cls,
        campaign: Campaign,
        measured: list[Record],
        floors: list[NoiseFloor],
        motion_noise: Spectrum | None,
        cell: LoadCell,
        timing: Callable[[list[Record]], list[Record]] = list,
        times: tuple[int, ...] = (),
    ) -> Evidence:
        full, records = at_search_rates(measured, floors, timing, times)
        folds = folds_of(records)
        return cls(campaign, measured, full, records, floors, folds, motion_noise, cell, times)

    def of_records(
        self, measured: list[Record], timing: Callable[[list[Record]], list[Record]] = list
    ) -> Evidence:
        """The same campaign's evidence from other versions of its records."""
        anew = self._of(
            self.campaign, measured, self.floors, self.motion_noise, self.cell, timing, self.times
        )
        return replace(
            anew,
            current_late_s=self.current_late_s,
            smoothing=self.smoothing,
            centres_m=self.centres_m,
            rests_s=self.rests_s,
        )

    def steadied(self, fit: JointFit) -> Evidence:
        """The same, without the motion's noise where a fit shows that it is that; itself where none is."""
        quiet = steadied(fit, self.measured, self.motion_noise)
        if all(a is b for a, b in zip(quiet, self.measured, strict=True)):
            return self
        return self.of_records(quiet)

    def resolved(self, fit: JointFit) -> Evidence:
        """The same, those runs at higher rates whose motion passes a damper's knee too fast for the usual."""
        here = self
        for _ in range(DOUBLINGS):
            usual = here.times or (1,) * len(here.measured)
            finer = here._at_times([2 * k for k in usual])
            fast = unresolved(fit, here.records, finer.records)
            if not any(fast):
                break
            here = here._at_times([2 * k if more else k for k, more in zip(usual, fast, strict=True)])
        return here

    def _at_times(self, times: Iterable[int]) -> Evidence:
        return replace(self, times=tuple(times)).of_records(self.measured)

    def sharpened(self, fit: JointFit) -> Evidence:
        """The same, with what a base's fit shows that a filter took off the velocities; itself if none."""
        spectrum = self.motion_noise
        smoothing = smoothing_of(fit, spectrum, partial(fitted_to, fit=fit))
        if smoothing is None or spectrum is None:
            return self
        sharp = self.of_records([smoothing.undone(r, spectrum) for r in self.measured])
        return replace(sharp, smoothing=smoothing)

    def zeroed(self, fit: JointFit) -> Evidence:
        """The same, without each run's own zero of the load cell as a fit sees it; itself if it has none.

        Nor where the fit leaves far more than noise: a wrong model's error has a mean in each run as well.
        """
        own = RunsOwn.of(fit)
        zeros = run_zeros(own.zeros_n, self.full, self.cell.zeros_n)
        if zeros.any():
            budget = self.budget(fit)
            if own.left * budget.judged > CLOSE_TO_NOISE * budget.noise:
                zeros = np.zeros(zeros.size)
        return self._with_cell(replace(self.cell, zeros_n=zeros))

    def scaled(self, fit: JointFit, fewest: int = FEWEST_RUNS) -> Evidence:
        """The same, without each run's own scale of the force as a fit sees it; itself if it has none.

        fewest: runs, to have scales at all.
        """
        gains = run_gains(RunsOwn.of(fit).scales, self.full, fewest)
        return self._with_cell(self.cell.with_gains(gains)) if gains.any() else self

    def evened(self, fit: JointFit) -> Evidence:
        """The same, without each run's own scale of the force, if with that a fit leaves nothing but noise.

        Else itself: what a wrong model leaves is in proportion to the force as well, and more besides.
        """
        even = self.scaled(fit)
        clean = even is self or even.budget(fitted_to(even.records, fit)).excess <= 0.0
        return even if clean else self

    def as_measured(self) -> Evidence:
        """The same with the forces as they were: what a wrong model misses in the mean is no zero."""
        return self._with_cell(LoadCell.true(len(self.measured)))

    def _with_cell(self, cell: LoadCell) -> Evidence:
        if cell.same_as(self.cell):
            return self
        anew = partial(cell.instead_of, self.cell)
        return replace(self.each(anew), cell=cell)

    def each(self, anew: Callable[[Sequence[Record]], list[Record]]) -> Evidence:
        """The same with other versions of its records at every rate."""
        return replace(self, measured=anew(self.measured), full=anew(self.full), records=anew(self.records))

    def synchronised(self, fit: JointFit) -> Evidence:
        """The same, the current as early as a base's fit shows that it acts; itself where it is not late.

        By how much, a fit of each of some tells: beside a step what is late is not in proportion to it.
        """
        late = current_late_s(fit)
        if late == 0.0:
            return self
        sample_s = max(r.finer / r.rate_hz for r in self.measured)
        tried = [late + k * sample_s for k in range(-LATE_AROUND, LATE_AROUND + 1)]
        early = [self._earlier(by) for by in tried if LEAST_S <= by <= MOST_S]
        return min(early, key=lambda one: fitted_to(one.records, fit).total)

    def _earlier(self, by_s: float) -> Evidence:
        return replace(self.of_records([earlier(r, by_s) for r in self.measured]), current_late_s=by_s)

    def stepless(self, fit: JointFit) -> JointFit:
        """A fit's base as the data show it that do not hang on when between two samples a current stepped.

        A filter that has made up for the steps' times hides when they were. What effects move stays.
        """
        return stepless(self.records, fit)

    def timed(self, fit: JointFit) -> Evidence:
        """The same, with the times of the current's steps taken from the force; itself where none shows."""
        full = timed(self.full, fit)
        if all(a is b for a, b in zip(full, self.full, strict=True)):
            return self
        return self.of_records(self.measured, lambda _: full)

    def candidates(self, known: Sequence[Effect]) -> tuple[list[Effect], dict[str, str]]:
        """Effects that this data can be searched for, and why the others cannot."""
        names = {e.name for e in known}
        found, left = [], {}
        still = all(float(np.ptp(r.displacement_m)) < MOVED_M for r in self.records)
        for effect in self.sized(effects().values()):
            if effect.name in names:
                continue
            if "displacement" in effect.needs and still:
                left[effect.name] = "the runs have no displacement"
            else:
                found.append(effect)
        return found, left

    def sized(self, chosen: Iterable[Effect]) -> list[Effect]:
        """Effects with the bounds that they have in a damper of this size."""
        force_n = ranges_of(self.measured).force_n
        return [sized(effect, force_n) for effect in chosen]

    def base(
        self,
        known: Sequence[Effect] = (),
        values: dict[str, tuple[float, ...]] | None = None,
        start: JointFit | None = None,
    ) -> Proof:
        """The base model, with the effects that the calibration has already, fitted to the searched records.

        start: a fit without effects to begin with.
        """
        return prove(base_fit(self.records, known, values, start), self.folds)

    def budget(self, fit: JointFit) -> Budget:
        """What a fit leaves, and how much of that is noise."""
        errors = self.steady_errors(fit)
        brought = [
            f[f.size - e.size :]
            for f, e in zip(input_noise(fit, self.full, self.motion_noise), errors, strict=True)
        ]
        return budget_of(errors, brought, self.floors, [r.rate_hz / r.finer for r in self.full])

    def bears_out(self, better: JointFit, plain: JointFit) -> bool:
        """Whether what was fitted to a part of the runs only does better on them whole, too.

        What heats, or remembers otherwise, goes on past the cycles that a search takes.
        """
        seconds = [sum(len(r) / r.rate_hz for r in records) for records in (self.records, self.full)]
        if seconds[0] > WHOLE * seconds[1]:
            return True
        errors = self.steady_errors(better), self.steady_errors(plain)
        return mean_square(errors[0]) < mean_square(errors[1])

    def steady_errors(self, fit: JointFit) -> list[Array]:
        """Measured less modelled force in N at the samples measured, without starts that a fit leaves out.

        Nor what hangs on when between two samples a current stepped.
        """
        forces = fit.model.on(self.full).predict(fit.theta)
        starts = [fit.model.settle_blocks(fit.theta, r) * fit.model.factor(r) // r.finer for r in self.full]
        return [
            without_steps(r, (r.force_n - force)[:: r.finer][start:])
            for r, force, start in zip(self.full, forces, starts, strict=True)
        ]

    def averaged_away_n2(self, fit: JointFit) -> float:
        """The mean square in N² of what a fit leaves at the samples measured that no search sees.

        It is as fast as that: a noise floor has it, and the means that a search works on have not.
        """
        taken, counts = 0.0, 0
        for searched, full, e in zip(self.records, self.full, self.steady_errors(fit), strict=True):
            weighed_hz = searched.rate_hz / fit.model.factor(searched)
            by = max(1, round(full.rate_hz / full.finer / weighed_hz))
            blocks = e[e.size % by :].reshape(-1, by)
            count = len(searched) // fit.model.factor(searched)
            counts += count
            taken += count * float(np.mean(np.var(blocks, axis=1))) if blocks.size else 0.0
        return taken / counts

    def at_samples_of(self, errors: Sequence[Array], signals: Sequence[Array]) -> list[Array]:
        """Signals of the full records at the samples that steady errors of theirs (n each) have."""
        measured = [x[:: r.finer] for r, x in zip(self.full, signals, strict=True)]
        return [x[x.size - e.size :] for x, e in zip(measured, errors, strict=True)]
