"""Reader's model, f(i) g(v) behind a first-order lag: no temperature (Eq. 3.1, 3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrctl.identify import base
from mrctl.identify.baselines.result import Array, Model, Quantity
from mrctl.identify.best import fit_base
from mrctl.identify.hysteresis import UNIT_RAD_S
from mrctl.identify.records import Record
from mrctl.measurements.run import Run

ORDER = 1


def fit_reader(records: Sequence[Record]) -> Model:
    """Tables and lag together on the time series, as the project's own model, without h and higher orders."""
    nominal_c = float(np.mean([r.temperature_c.mean() for r in records]))
    blind = [replace(r, temperature_c=np.full(len(r), nominal_c)) for r in records]
    fit = fit_base(blind, order=ORDER)
    layout, tables = fit.model.layout, fit.tables
    # A first-order filter as the fit has it may keep a direct path; Eq. 3.2 has none.
    tables = replace(tables, filter=np.array([tables.filter[0], 0.0]))
    model = fit.model
    held = np.ones(layout.size, dtype=bool)
    held[layout.parts["filter"].stop - 1] = False
    fit = model.fit(layout.pack(tables), rounds=2, free=held)
    tables = fit.tables

    def predict(run: Run) -> Array:
        at = base.Inputs.of(
            layout, run.sample_rate_hz, run.velocity_m_s, run.current_a, np.full(len(run), nominal_c)
        )
        return base.force(at, tables)

    corner_hz = float(np.exp(tables.filter[0])) * UNIT_RAD_S / (2.0 * np.pi)
    scale = float(np.max(np.abs(tables.g)))
    parameters = {
        f"f({i:.3g} A)": Quantity(float(f) * scale, "N")
        for i, f in zip(layout.current_a, tables.f, strict=True)
    }
    return Model(parameters | {"corner": Quantity(corner_hz, "Hz")}, predict)
