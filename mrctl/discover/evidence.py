"""What a diagnosis works on: records at a rate that can be searched, their noise, the base model's fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.folds import folds_of
from mrctl.discover.input_noise import input_noise
from mrctl.discover.noise_floor import NoiseFloor, noise_floor
from mrctl.discover.proof import Proof, prove
from mrctl.discover.refit import part
from mrctl.discover.search import Folds
from mrctl.discover.spectral_floor import spectral_floor
from mrctl.errors import InputError
from mrctl.identify.best import fit_base
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointFit, JointModel
from mrctl.identify.records import Record, possible_rise_k, records_of
from mrctl.measurements.run import Campaign
from mrctl.model.effects.base import Effect
from mrctl.model.effects.registry import effects

Array = NDArray[np.float64]

SEARCHED_SAMPLES = 30000  # more are averaged down, as far as SLOWEST_HZ
SLOWEST_HZ, FASTEST_HZ = 400.0, 500.0  # slower ones are refined
REST_M_S = 1e-4
MOVED_M = 1e-5
MOST_COLOURED = 5.0  # noise over its sample-to-sample part, for noise that remembers 95 % of a sample
FEWEST_CYCLES = 4  # of a run that repeats, to be searched
LONGEST_S = 10.0  # a longer run may be heating up
KNOWN_SHARE = 0.5  # of the samples whose noise must be known from cycles


@dataclass(frozen=True, slots=True)
class Budget:
    """Mean squares in N² at full rate: what a fit leaves, that where the noise is known, the noise there."""

    total: float
    judged: float
    noise: float
    measured: bool  # from cycle to cycle


@dataclass(frozen=True, eq=False)
class Evidence:
    """The campaign's moving runs: at full rate, at the rate of the search, with noise floors and folds."""

    campaign: Campaign
    full: list[Record]
    records: list[Record]
    floors: list[NoiseFloor]
    folds: Folds

    @classmethod
    def of(cls, campaign: Campaign) -> Evidence:
        """Raises InputError when no run moves the damper and measures its force."""
        full = [
            r.refined(int(np.ceil(SLOWEST_HZ / r.rate_hz)))
            for r in records_of(campaign.runs)
            if float(np.max(np.abs(r.velocity_m_s))) > REST_M_S and float(np.ptp(r.force_n)) > 0.0
        ]
        if not full:
            raise InputError.at(
                campaign.root,
                "no run moves the damper and measures its force",
                "measure velocity and force in motion",
            )
        seconds = sum(len(r) / r.rate_hz for r in full)
        rate = float(np.clip(SEARCHED_SAMPLES / seconds, SLOWEST_HZ, FASTEST_HZ))
        floors = [noise_floor(campaign.runs[r.run]) for r in full]
        share = SEARCHED_SAMPLES / (seconds * rate)
        records = [
            _shortened(r, f, share).decimated(max(1, int(r.rate_hz / rate)))
            for r, f in zip(full, floors, strict=True)
        ]
        return cls(campaign, full, records, floors, folds_of(records))

    def candidates(self, known: Sequence[Effect]) -> tuple[list[Effect], dict[str, str]]:
        """Effects that this data can be searched for, and why the others cannot."""
        names = {e.name for e in known}
        found, left = [], {}
        still = all(float(np.ptp(r.displacement_m)) < MOVED_M for r in self.records)
        for effect in effects().values():
            if effect.name in names:
                continue
            if "displacement" in effect.needs and still:
                left[effect.name] = "the runs have no displacement"
            else:
                found.append(effect)
        return found, left

    def base(self, known: Sequence[Effect] = (), values: dict[str, tuple[float, ...]] | None = None) -> Proof:
        """The base model, with the effects that the calibration has already, fitted to the searched records.

        Every record counts with the noise of the whole fit: one that fits badly is what is looked for, and
        must not be weighed down.
        """
        fit = fit_base(self.records, warmer_k=possible_rise_k(self.records))
        model = JointModel(fit.model.layout, self.records, Effects(tuple(known)))
        theta = np.concatenate([fit.theta, model.effects.pack(values or {})])
        model.reweigh(theta)
        old = {p.name: p.weight for p in fit.penalties}
        penalties = [replace(p, weight=old.get(p.name, p.weight)) for p in model.penalties()]
        fit = model.fit(theta, penalties=penalties, rounds=1, iterations=10, tolerance=1e-4)
        return prove(fit, self.folds)

    def budget(self, fit: JointFit) -> Budget:
        """What a fit leaves, and how much of that is noise.

        Where runs do not repeat, the noise is read off the spectrum of what the fit leaves, and what the
        measured velocity's own noise makes of the model's force is added. Where neither shows it, all that is
        left counts as noise: then only what the signals predict of it is known not to be.
        """
        errors = self.steady_errors(fit)
        total = float(np.mean(np.concatenate(errors) ** 2))
        known = [(f.floor_n, e) for f, e in zip(self.floors, errors, strict=True) if f.floor_n is not None]
        samples = sum(e.size for _, e in known)
        if samples >= KNOWN_SHARE * sum(e.size for e in errors):
            # Runs whose noise is not known are not held against that of the others.
            noise = sum(e.size * f * f for f, e in known) / samples
            return Budget(total, sum(float(e @ e) for _, e in known) / samples, noise, measured=True)
        brought = [f[f.size - e.size :] for f, e in zip(input_noise(fit, self.full), errors, strict=True)]
        spectral = spectral_floor(errors, [r.rate_hz / r.finer for r in self.full], brought)
        # Sharp physics that no effect follows reaches above 30 Hz too, but not up to the sample rate.
        least = float(np.median([f.lower_bound_n for f in self.floors]))
        most = (MOST_COLOURED * least) ** 2 + float(np.mean(np.concatenate(brought) ** 2))
        noise = min(total, most) if spectral is None else min(spectral.noise_n**2, total, most)
        return Budget(total, total, noise, measured=False)

    def steady_errors(self, fit: JointFit) -> list[Array]:
        """Measured less modelled force in N at the samples measured, without starts that a fit leaves out."""
        model = fit.model.on(self.full)
        return [
            e[:: r.finer][model.settle_blocks(fit.theta, r) * model.factor(r) // r.finer :]
            for r, e in zip(self.full, model.errors(fit.theta), strict=True)
        ]


def _shortened(record: Record, floor: NoiseFloor, share: float) -> Record:
    """That share of a short run that repeats, a few cycles at least; any other run whole."""
    if share >= 1.0 or floor.cycles < FEWEST_CYCLES or len(record) / record.rate_hz > LONGEST_S:
        return record
    return part(record, 0, int(len(record) * max(share, FEWEST_CYCLES / floor.cycles)))


def full_errors(fit: JointFit, records: Sequence[Record]) -> list[Array]:
    """Measured less modelled force in N at every sample of the given records."""
    return fit.model.on(records).errors(fit.theta)
