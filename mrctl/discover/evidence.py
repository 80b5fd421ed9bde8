"""What a diagnosis works on: records at a rate that can be searched, their noise, the base model's fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.folds import folds_of
from mrctl.discover.noise_floor import NoiseFloor, noise_floor
from mrctl.discover.proof import Proof, prove
from mrctl.discover.search import Folds
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

    def floor_mean_square(self, proof: Proof) -> float | None:
        """The noise's mean square in N² at the rate of the search; None where too little of it is known.

        Averaging takes off fast noise but no model error, so what the averaged residual has lost, the noise
        has lost too.
        """
        fit = proof.fit
        full = full_errors(fit, self.full)
        known, total, excess = 0.0, 0.0, 0.0
        for record, error, floor in zip(self.full, full, self.floors, strict=True):
            total += len(record)
            if floor.floor_n is None:
                continue
            known += len(record)
            excess += len(record) * (float(np.mean(error**2)) - floor.floor_n**2)
        if known < 0.5 * total:
            return None
        here = float(
            np.sum([i for i, f in zip(proof.inside, self.floors, strict=True) if f.floor_n is not None])
            / np.sum([c for c, f in zip(proof.counts, self.floors, strict=True) if f.floor_n is not None])
        )
        return max(here - excess / known, 0.0)


def full_errors(fit: JointFit, records: Sequence[Record]) -> list[Array]:
    """Measured less modelled force in N at every sample of the given records."""
    return fit.model.on(records).errors(fit.theta)
