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
from mrctl.discover.search import Folds
from mrctl.discover.spectral_floor import spectral_floor
from mrctl.errors import InputError
from mrctl.identify.best import fit_base
from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointFit, JointModel
from mrctl.identify.records import Record, records_of
from mrctl.measurements.run import Campaign
from mrctl.model.effects.base import Effect
from mrctl.model.effects.registry import effects

Array = NDArray[np.float64]

SEARCHED_SAMPLES = 30000  # more are averaged down, as far as SLOWEST_HZ
SLOWEST_HZ, FASTEST_HZ = 200.0, 500.0
REST_M_S = 1e-4
MOVED_M = 1e-5
KNOWN_SHARE = 0.5  # of the samples whose noise must be known from cycles


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
            r
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
        records = [r.decimated(max(1, int(r.rate_hz / rate))) for r in full]
        floors = [noise_floor(campaign.runs[r.run]) for r in full]
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
        fit = fit_base(self.records)
        model = JointModel(fit.model.layout, self.records, Effects(tuple(known)))
        theta = np.concatenate([fit.theta, model.effects.pack(values or {})])
        model.reweigh(theta)
        old = {p.name: p.weight for p in fit.penalties}
        penalties = [replace(p, weight=old.get(p.name, p.weight)) for p in model.penalties()]
        fit = model.fit(theta, penalties=penalties, rounds=1, iterations=10, tolerance=1e-4)
        return prove(fit, self.folds)

    def floor_n(self, fit: JointFit) -> tuple[float, bool]:
        """(noise RMS in N at full rate, whether it was measured from cycle to cycle).

        Where runs do not repeat, it is read off the spectrum of what the fit leaves, and what the measured
        velocity's own noise makes of the model's force is added.
        """
        known = [
            (f.floor_n, len(r)) for f, r in zip(self.floors, self.full, strict=True) if f.floor_n is not None
        ]
        if sum(n for _, n in known) >= KNOWN_SHARE * sum(map(len, self.full)):
            return float(np.sqrt(sum(n * f * f for f, n in known) / sum(n for _, n in known))), True
        errors = self.steady_errors(fit)
        brought = [f[f.size - e.size :] for f, e in zip(input_noise(fit, self.full), errors, strict=True)]
        spectral = spectral_floor(errors, [r.rate_hz for r in self.full], brought)
        if spectral is None:
            return 0.0, False
        return min(spectral.noise_n, float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))), False

    def steady_errors(self, fit: JointFit) -> list[Array]:
        """Measured less modelled force in N at full rate, without the starts that the fit leaves out."""
        model = fit.model.on(self.full)
        return [
            e[model.settle_blocks(fit.theta, r) * model.factor(r) :]
            for r, e in zip(self.full, model.errors(fit.theta), strict=True)
        ]


def full_errors(fit: JointFit, records: Sequence[Record]) -> list[Array]:
    """Measured less modelled force in N at every sample of the given records."""
    return fit.model.on(records).errors(fit.theta)
