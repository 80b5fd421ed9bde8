"""A model against measurements: errors by run and over all, beside the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.conditions import Band, Condition, bands, worst_conditions
from mrctl.discover.noise.noise_floor import NoiseFloor, noise_floor, pooled_floor
from mrctl.identify.forward import modelled
from mrctl.identify.result import Errors, errors_of
from mrctl.measurements.run import Campaign, Run
from mrctl.model.damper import Damper

Array = NDArray[np.float64]

START = (
    "What was before a run is what its first forces fit best: its first sample for ever, rest, or its motion "
    "turned round, and for a field with a memory another current; no sample is left out."
)

BEYOND_NOISE = 1.5  # times the noise, from which an error is said to be more than that
ANOTHER = 3.0  # times another's force, or a third of it: hardly this damper's


@dataclass(frozen=True, slots=True, eq=False)
class RunFit:
    """One run with the model's force and the residual, measured less modelled, each (n) in N."""

    run: Run
    model_n: Array
    residual_n: Array
    rmse_n: float
    rmse_percent: float  # of the run's largest absolute force
    fit_percent: float
    bias_n: float
    noise: NoiseFloor


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """All runs of a campaign against one damper's model."""

    runs: tuple[RunFit, ...]
    rmse_n: float
    fit_percent: float
    bias_n: float
    noise_floor_n: float | None  # over the runs where it is known
    worst: tuple[Condition, ...]
    bands: tuple[Band, ...]

    @property
    def force_ratio(self) -> float:
        """The RMS of the model's force over that of the measured one."""
        model, measured = (
            float(np.sqrt(np.mean(np.concatenate(forces) ** 2)))
            for forces in ([fit.model_n for fit in self.runs], [fit.run.force_n for fit in self.runs])
        )
        return model / max(measured, 1e-300)

    @property
    def of_another(self) -> str | None:
        """What seems wrong with the whole where the model's force is of another size, else None."""
        ratio = self.force_ratio
        if 1.0 / ANOTHER < ratio < ANOTHER:
            return None
        return f"the model's force is {ratio:.3g} times the measured one"

    @property
    def nowhere(self) -> str:
        """What to say where no condition is worse than the others, with the run that is and the noise."""
        said = "nowhere significantly worse than on average"
        floor = self.noise_floor_n
        if floor is None or self.rmse_n <= BEYOND_NOISE * floor:
            return said
        worst = max(self.runs, key=lambda fit: fit.rmse_n)
        times = f"{self.rmse_n / floor:.2g} times the noise"
        return f"{said}, which is {times}; most in {worst.run.name}, {worst.rmse_n:.3g} N"


def compare(
    damper: Damper, campaign: Campaign, progress: Callable[[str], None] = lambda _: None
) -> Comparison:
    """How well the damper's model follows the campaign, and where it fails.

    Raises EffectError where an effect needs a signal that a run lacks.
    """
    forces: list[Array] = []
    floors: list[NoiseFloor] = []
    for run in campaign.runs:
        forces.append(modelled(damper, run))
        floors.append(noise_floor(run))
        progress(run.name)
    errors = errors_of(campaign, list(range(len(forces))), forces)
    return _gathered(campaign, forces, floors, errors)


def _gathered(
    campaign: Campaign, forces: list[Array], floors: list[NoiseFloor], errors: Errors
) -> Comparison:
    fits = []
    for run, force, floor, row in zip(campaign.runs, forces, floors, errors.runs, strict=True):
        residual = run.force_n - force
        fits.append(
            RunFit(
                run,
                force,
                residual,
                row.rmse_n,
                row.rmse_percent,
                row.fit_percent,
                float(residual.mean()),
                floor,
            )
        )
    runs, residuals = list(campaign.runs), [fit.residual_n for fit in fits]
    return Comparison(
        tuple(fits),
        errors.rmse_n,
        errors.fit_percent,
        float(np.concatenate(residuals).mean()),
        pooled_floor(floors, [len(run) for run in runs]),
        tuple(worst_conditions(runs, residuals)),
        tuple(bands(runs, residuals)),
    )


def figures(comparison: Comparison) -> dict[str, Any]:
    """The comparison as JSON-ready figures."""
    return {
        "rmse_n": comparison.rmse_n,
        "fit_percent": comparison.fit_percent,
        "bias_n": comparison.bias_n,
        "noise_floor_n": comparison.noise_floor_n,
        "force_ratio": comparison.force_ratio,
        "noise_floor_runs": sum(fit.noise.floor_n is not None for fit in comparison.runs),
        "start": START,
        "runs": [_run_figures(fit) for fit in comparison.runs],
        "worst": [
            {
                "variable": c.variable,
                "from": c.low,
                "to": c.high,
                "unit": c.unit,
                "rmse_n": c.rmse_n,
                "bias_n": c.bias_n,
                "words": c.words,
            }
            for c in comparison.worst
        ],
        "bands": [{"from_hz": b.low_hz, "to_hz": b.high_hz, "rms_n": b.rms_n} for b in comparison.bands],
    }


def _run_figures(fit: RunFit) -> dict[str, Any]:
    return {
        "file": fit.run.name,
        "rmse_n": fit.rmse_n,
        "fit_percent": fit.fit_percent,
        "rmse_percent": fit.rmse_percent,
        "bias_n": fit.bias_n,
        "samples": len(fit.run),
        "noise_floor_n": fit.noise.floor_n,
        "noise_lower_bound_n": fit.noise.lower_bound_n,
        "noise_method": fit.noise.method,
        "noise_cycles": fit.noise.cycles,
        "effective_samples": fit.noise.effective_samples,
        "drift_n": fit.noise.drift_n,
    }
