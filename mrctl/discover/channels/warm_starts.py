"""How warm the fluid still was as each run began: what the runs before had left in it, as no file tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import Penalty
from mrctl.identify.records import Record
from mrctl.identify.run_scatter import ScatteredModel
from mrctl.identify.solver import Normal, solve
from mrctl.model.effects.self_heating import RISE_AT_START

Array = NDArray[np.float64]

USUAL_K = 5.0  # how far the starts of runs are apart
MOST_K = 40.0
CLEARLY = 0.9  # of the square sum: more is as good without any warmth
STEP_K = 0.1  # by which slopes are taken
ITERATIONS, TOLERANCE = 30, 0.5
ANY_SCALE = 10.0  # a spread of the runs' scales at which each is free


def warm_starts(fit: JointFit, begin: Array) -> tuple[Array, Array, float]:
    """A model's vector fitted with the starts of its records free, these in K (runs), and what that costs.

    begin: the vector to begin at. How much warmer a record's fluid begins than the effect says is drawn to
    none by how far runs usually are apart.
    """
    model = fit.model
    runs, size = len(model.records), begin.size
    lower, upper = model.bounds()
    far = np.full(runs, MOST_K / USUAL_K)
    starts = np.pad(np.eye(runs), ((0, 0), (size, 0)))
    penalties = [replace(p, rows=np.pad(p.rows, ((0, 0), (0, runs)))) for p in fit.penalties]
    penalties.append(Penalty("starts", starts, np.zeros(runs), 1.0, adapts=False))
    solution = solve(
        partial(_normal, model),
        partial(_cost, model),
        np.concatenate([begin, np.zeros(runs)]),
        np.concatenate([lower, -far]),
        np.concatenate([upper, far]),
        penalties,
        free=np.concatenate([fit.model.free(), np.ones(runs, dtype=bool)]),
        iterations=ITERATIONS,
        tolerance=TOLERANCE,
    )
    theta, by_k = _parts(model, solution.theta)
    held = sum(0.5 * p.weight * p.excess(solution.theta) for p in penalties)
    return theta, by_k, solution.normal.cost + held


def warmed(records: Sequence[Record], by_k: Array) -> list[Record]:
    """The records with their fluids that much warmer at their starts (runs)."""
    return [replace(r, warmer_k=r.warmer_k + k) for r, k in zip(records, by_k.tolist(), strict=True)]


def begin_as_fluids_do(fit: JointFit) -> bool:
    """Whether every run begins no farther from its case's temperature than a fluid may."""
    for effect in fit.model.effects.chosen:
        values = zip(effect.parameters, fit.effect_values[effect.name], strict=True)
        for alike_k in (value for p, value in values if p.name == RISE_AT_START.name):
            begins_k = [alike_k + r.warmer_k for r in fit.model.records]
            if min(begins_k) < RISE_AT_START.low or max(begins_k) > RISE_AT_START.high:
                return False
    return True


def more_than_scales(before: JointFit, warm: JointFit) -> bool:
    """Whether a warm model does clearly better than one without, were each run's own scale free in both.

    So it is what warms and cools within the runs that speaks for it, not that the runs differ.
    """
    plain = before.model
    scaled = ScatteredModel(
        plain.layout, plain.records, plain.effects, plain.minimum_phase, plain.slowest_pole
    )
    scaled.weigh_as(plain)
    scaled.levels = [
        scaled.weighed(r, f) for r, f in zip(plain.records, plain.predict(before.theta), strict=True)
    ]
    scaled.spread = ANY_SCALE
    without = scaled.fit(before.theta, penalties=before.penalties, free=before.moving, rounds=1)
    left, least = less_scales(without), less_scales(warm)
    squares = [sum(float(one @ one) for one in rest) for rest in (least, left)]
    return squares[0] < CLEARLY * squares[1]


def less_scales(fit: JointFit) -> list[Array]:
    """What a fit leaves of each record, less what is in proportion to its force (blocks each)."""
    model, found = fit.model, []
    for record, force, rest in zip(
        model.records, model.predict(fit.theta), model.residuals(fit.theta), strict=True
    ):
        along = model.weighed(record, force)[-rest.size :]
        found.append(rest - along * float(along @ rest) / max(float(along @ along), 1e-300))
    return found


def _parts(model: JointModel, whole: Array) -> tuple[Array, Array]:
    """The model's vector and the starts in K, of one vector of both."""
    return whole[: model.size], USUAL_K * whole[model.size :]


def _cost(model: JointModel, whole: Array) -> float:
    theta, by_k = _parts(model, whole)
    return model.placed(warmed(model.records, by_k)).cost(theta)


def _normal(model: JointModel, whole: Array) -> Normal:
    """The normal equations of a model's vector and the starts: each moves its own record."""
    theta, by_k = _parts(model, whole)
    here, warmer = (model.placed(warmed(model.records, by_k + more)) for more in (0.0, STEP_K))
    forces = zip(here.predict(theta), warmer.predict(theta), strict=True)
    matrix, right, cost = np.zeros((whole.size, whole.size)), np.zeros(whole.size), 0.0
    each = zip(model.records, model.weights, forces, here.jacobians(theta), strict=True)
    for k, (record, weight, (cold, warm), (rest, rows)) in enumerate(each):
        by_start = here.weighed(record, warm - cold)[-rest.size :] * (USUAL_K / STEP_K)
        index = np.append(rows.index, model.size + k)
        values = np.vstack([rows.values, by_start])
        matrix[np.ix_(index, index)] += weight * (values @ values.T)
        right[index] += weight * (values @ rest)
        cost += 0.5 * weight * float(rest @ rest)
    return Normal(matrix, right, cost)
