"""Liu's model read forwards: a viscous force that thins when warm, a power of the current (Eq. 2.2, 2.3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from mrctl.identify.baselines.result import Array, Model, Quantity
from mrctl.identify.records import Record
from mrctl.measurements.run import Run
from mrctl.model.baselines.liu import viscosity_pa_s

EXPONENTS = (0.1, 3.0)


def fit_liu(records: Sequence[Record]) -> Model:
    """k, alpha and beta of F = k mu(T) v + alpha i^beta sign(v), by least squares on every sample.

    Each run counts by its error over its largest force, which is what is reported.
    """
    v, i, warm, force = (
        np.concatenate([getattr(r, name) for r in records])
        for name in ("velocity_m_s", "current_a", "temperature_c", "force_n")
    )
    weight = np.concatenate([np.full(len(r), 1.0 / np.max(np.abs(r.force_n))) for r in records])
    shear, side, i = _viscosity(warm) * v * weight, np.sign(v) * weight, np.maximum(i, 0.0)
    force = force * weight

    def linear(exponent: float) -> tuple[Array, float]:
        columns = np.stack([shear, i**exponent * side], axis=1)
        gains = np.maximum(np.linalg.lstsq(columns, force, rcond=None)[0], 0.0)
        return gains, float(np.sum((force - columns @ gains) ** 2))

    found = minimize_scalar(lambda exponent: linear(exponent)[1], bounds=EXPONENTS, method="bounded")
    beta = float(found.x)
    length, alpha = (float(x) for x in linear(beta)[0])

    def predict(run: Run) -> Array:
        viscous = length * _viscosity(run.temperature_c) * run.velocity_m_s
        yielding = alpha * np.maximum(run.current_a, 0.0) ** beta * np.sign(run.velocity_m_s)
        return np.asarray(viscous + yielding, dtype=np.float64)

    parameters = {
        "viscous_length": Quantity(length, "m"),
        "field_force": Quantity(alpha, "N/A^exponent"),
        "exponent": Quantity(beta, "1"),
    }
    return Model(parameters, predict)


def _viscosity(temperature_c: Array) -> Array:
    return np.asarray(np.vectorize(viscosity_pa_s, otypes=[float])(temperature_c), dtype=np.float64)
