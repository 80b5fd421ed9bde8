"""What tables with a knot between each two of theirs would take of what a model leaves.

Tables are straight between knots, and a small effect may be no more than their form. It is more where it says
more than finer tables would, for its few parameters.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.proof import Proof
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.layout import Layout, Tables
from mrctl.identify.solver import scaled_solution

Array = NDArray[np.float64]

RIDGE = 1e-8  # of each parameter's own information


def finer_score(proof: Proof, colour: Array) -> float:
    """Twice the log-likelihood ratio of finer tables to a model's, less what their values must earn (BIC).

    To first order: the finer tables' slopes at the same values, all free. colour: samples that count as one
    in each record.
    """
    model, theta = finer(proof.fit)
    pairs = _with_finer(model, theta)
    was, left = (np.maximum([float(part @ part) for part in one], 1e-300) for one in pairs)
    more = model.size - proof.fit.model.size
    independent = proof.counts / colour
    return float(independent @ np.log(was / left)) - more * float(np.log(independent.sum()))


def left_by_finer(proof: Proof) -> list[Array]:
    """What finer tables would leave of a model's residuals in N, to first order as in `finer_score`."""
    return _with_finer(*finer(proof.fit))[1]


def _with_finer(model: JointModel, theta: Array) -> tuple[list[Array], list[Array]]:
    """The residuals of a model with finer tables, at the values of coarser ones and at its own best ones."""
    gram, right, rows = np.zeros((model.size, model.size)), np.zeros(model.size), []
    for weight, (rest, line) in zip(model.weights, model.jacobians(theta), strict=True):
        line.add_to(gram, right, rest, weight)
        rows.append((rest, line))
    step = scaled_solution(gram, right, RIDGE, np.diag(gram))
    model.forget()
    return [rest for rest, _ in rows], [rest - step[line.index] @ line.values for rest, line in rows]


def finer(fit: JointFit) -> tuple[JointModel, Array]:
    """A fit's model with a knot between each two of its tables', and the vector of the same forces."""
    model, layout = fit.model, _finer_layout(fit.model.layout)
    finer_model = JointModel(layout, model.records, model.effects, model.minimum_phase, model.slowest_pole)
    finer_model.weigh_as(model)
    own = layout.pack(_finer_tables(fit.tables))
    return finer_model, np.concatenate([own, fit.theta[model.layout.size :]])


def _finer_layout(layout: Layout) -> Layout:
    return replace(
        layout,
        current_a=_between(layout.current_a),
        velocity_m_s=_between(layout.velocity_m_s),
        temperature_c=_between(layout.temperature_c),
        reference=2 * layout.reference,
        gauge=2 * layout.gauge,
    )


def _finer_tables(tables: Tables) -> Tables:
    f, g, h_on, h_off = (_between(x) for x in (tables.f, tables.g, tables.h_on, tables.h_off))
    return replace(tables, f=f, g=g, h_on=h_on, h_off=h_off)


def _between(x: Array) -> Array:
    """Values (n,) with the mean of each two between them (2 n - 1,)."""
    return np.interp(np.arange(2 * x.size - 1) / 2.0, np.arange(x.size), x)
