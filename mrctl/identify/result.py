"""What an identification gives: a damper, how well it fits, how sure it is, and what it could not know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.findings import Finding
from mrctl.identify.joint_fit import JointFit
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper

Array = NDArray[np.float64]

ON_A = 0.5  # mean current from which a run counts as on


@dataclass(frozen=True, slots=True)
class RunError:
    """How well the model follows one run."""

    file: str
    current_a: float  # mean
    temperature_c: float  # mean
    rmse_n: float
    rmse_percent: float  # of the run's largest absolute force
    fit_percent: float


@dataclass(frozen=True, slots=True)
class Errors:
    """How well the model follows a campaign; a group without runs has None."""

    runs: tuple[RunError, ...]
    rmse_n: float
    fit_percent: float
    rmse_percent_on: float | None
    rmse_percent_off: float | None


@dataclass(frozen=True, slots=True, eq=False)
class IdentificationResult:
    """A damper identified from a campaign.

    std: standard deviations by calibration key. findings: what was not identifiable. fit: the joint fit, for
    those who go on from here.
    """

    damper: Damper
    std: dict[str, tuple[float, ...]]
    findings: tuple[Finding, ...]
    errors: Errors
    steps: tuple[tuple[str, float], ...]  # (what, held-out or training RMSE in N)
    fit: JointFit


def errors_of(campaign: Campaign, numbers: list[int], forces: list[Array]) -> Errors:
    """Errors of predicted forces (n each) for the campaign's runs with these numbers."""
    rows, misses, spreads = [], [], []
    for number, force in zip(numbers, forces, strict=True):
        run = campaign.runs[number]
        miss = run.force_n - force
        spread = run.force_n - run.force_n.mean()
        rmse = float(np.sqrt(np.mean(miss**2)))
        peak = float(np.max(np.abs(run.force_n)))
        rows.append(
            RunError(
                run.name,
                float(run.current_a.mean()),
                float(run.temperature_c.mean()),
                rmse,
                100.0 * rmse / peak if peak > 0.0 else 0.0,
                _fit_percent(miss, spread),
            )
        )
        misses.append(miss)
        spreads.append(spread)
    pooled, measured = np.concatenate(misses), np.concatenate([campaign.runs[n].force_n for n in numbers])
    on = [row.rmse_percent for row in rows if row.current_a >= ON_A]
    off = [row.rmse_percent for row in rows if row.current_a < ON_A]
    return Errors(
        tuple(rows),
        float(np.sqrt(np.mean(pooled**2))),
        _fit_percent(pooled, measured - measured.mean()),
        float(np.mean(on)) if on else None,
        float(np.mean(off)) if off else None,
    )


def _fit_percent(miss: Array, spread: Array) -> float:
    size = float(np.linalg.norm(spread))
    return 100.0 * (1.0 - float(np.linalg.norm(miss)) / size) if size > 0.0 else 0.0
