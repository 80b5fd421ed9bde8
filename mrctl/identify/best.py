"""The better method: everything fitted together on the time series, for any campaign."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.errors import InputError
from mrctl.identify import base, hysteresis
from mrctl.identify.filter_fit import search_filter
from mrctl.identify.findings import findings_of
from mrctl.identify.finish import damper_of, table_std
from mrctl.identify.joint import WEIGHING_RATE_HZ, JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.layout import Layout, Tables
from mrctl.identify.processes import in_processes
from mrctl.identify.records import Record, records_of
from mrctl.identify.result import IdentificationResult, errors_of
from mrctl.identify.slow_poles import misfit, within_reach
from mrctl.identify.start import layout_for, start_values
from mrctl.measurements.run import Campaign

Array = NDArray[np.float64]
Report = Callable[[int, int, str], None]

START_RECORDS = 6
START_LAGS_HZ = (3.0, 10.0, 40.0)
ROUGH_KNOTS = 14
MORE_SEARCHES = 4
COARSE_ROUNDS, FINE_ROUNDS = 3, 2
ENOUGH_SAMPLES = 24000  # weighed, for the coarse rounds
SHORTEST_S = 1.0
ALIKE_SHARE = 0.9  # of a record's range, that its beginning must have
STEADY = {"velocity_m_s": 0.0, "current_a": 0.01, "temperature_c": 2.0}  # ranges that are none


def identify_best(campaign: Campaign, progress: Report | None = None) -> IdentificationResult:
    """Identify a damper from any campaign: everything fitted together on the time series.

    progress(done, total, what) is told how far it is. Raises InputError when no run moves.
    """
    report = progress or _silent
    records = records_of(campaign.runs)
    moving = [
        r for r in records if float(np.max(np.abs(r.velocity_m_s))) > 0.0 and float(np.ptp(r.force_n)) > 0.0
    ]
    if not moving:
        raise InputError.at(
            campaign.root,
            "no run moves the damper and measures its force",
            "measure velocity and force in motion",
        )
    report(0, 4, "first fit")
    fit = fit_base(moving)
    report(2, 4, "intervals")
    spread = fit.covariance()
    std = table_std(fit, spread)
    report(3, 4, "inverse filter")
    damper = damper_of(fit)
    errors = errors_of(campaign, [r.run for r in moving], fit.model.predict(fit.theta))
    report(4, 4, "done")
    steps = (("base", errors.rmse_n),)
    return IdentificationResult(damper, std, findings_of(fit, std, damper), errors, steps, fit)


def _silent(done: int, total: int, what: str) -> None:
    """Tell nobody."""


def fit_base(records: Sequence[Record], order: int = 3, *, warmer_k: float = 0.0) -> JointFit:
    """The base model of these records; h has knots up to `warmer_k` above the case's temperatures."""
    layout = layout_for(records, order, warmer_k=warmer_k)
    start = rough_fit(records, order)
    theta = layout.pack(moved(start.tables, start.model.layout, layout))
    coarse = JointModel(layout, enough([coarser(r) for r in records]))
    coarse.reweigh(theta)
    near = within_reach(coarse.fit(theta, rounds=COARSE_ROUNDS, iterations=10), COARSE_ROUNDS, 10)
    final = JointModel(layout, records, slowest_pole=near.model.slowest_pole)
    final.reweigh(near.theta, each=True)
    return final.fit(near.theta, penalties=near.penalties, rounds=FINE_ROUNDS, iterations=10)


def coarser(record: Record) -> Record:
    """A record at the rate at which forces are compared: most of the way of a fit needs no more."""
    return record if record.finer > 1 else record.decimated(int(record.rate_hz / WEIGHING_RATE_HZ))


def enough(records: Sequence[Record]) -> list[Record]:
    """The beginnings of records that go on as they began, where there is more than a first fit needs."""
    share = ENOUGH_SAMPLES / sum(len(r) for r in records)
    return [_beginning(r, max(share, SHORTEST_S * r.rate_hz / len(r))) for r in records]


def _beginning(record: Record, share: float) -> Record:
    if share >= 1.0:
        return record
    first = record.part(0, int(share * len(record)))
    for name in ("velocity_m_s", "current_a", "temperature_c"):
        whole = float(np.ptp(getattr(record, name)))
        if float(np.ptp(getattr(first, name))) < ALIKE_SHARE * whole - STEADY[name]:
            return record
    return first


def rough_fit(records: Sequence[Record], order: int) -> JointFit:
    """A fit of few records on few knots: tables and filter in turn and together, from several lags."""
    some = [coarser(r) for r in few(records)]
    layout = layout_for(some, order, velocity_knots=ROUGH_KNOTS)

    def from_lag(hz: float) -> JointFit:
        start = _search_and_fit(_lagged(some, layout.with_order(1), hz), layout)
        return _search_and_fit(start, layout)

    best = min(in_processes(from_lag, START_LAGS_HZ, [layout, *some]), key=misfit)
    for _ in range(MORE_SEARCHES):
        again = _search_and_fit(best, layout)
        gain = misfit(best) - misfit(again)
        best = again if gain > 0.0 else best
        if gain < 0.01 * sum(map(len, some)):
            break
    return best


def _lagged(records: Sequence[Record], layout: Layout, lag_hz: float) -> JointFit:
    """The tables behind a given plain lag."""
    model = JointModel(layout, records)
    theta = start_values(model)
    part = layout.parts["filter"]
    theta[part] = [np.log(2 * np.pi * lag_hz / hysteresis.UNIT_RAD_S), 0.1]
    free = np.ones(theta.size, dtype=bool)
    free[part] = False
    return model.fit(theta, rounds=1, iterations=4, tolerance=1e-3, free=free)


def _search_and_fit(fit: JointFit, layout: Layout) -> JointFit:
    """The best filter for these tables, then both together."""
    tables = replace(fit.tables, filter=_searched_filter(fit, layout.order))
    model = JointModel(layout, fit.model.records, minimum_phase=True)
    theta = layout.pack(tables)
    model.reweigh(theta)
    fit = model.fit(theta, rounds=1, iterations=8, tolerance=1e-3)
    model.reweigh(fit.theta)
    return model.fit(fit.theta, rounds=1, iterations=8, tolerance=1e-3)


def moved(t: Tables, old: Layout, new: Layout) -> Tables:
    """Tables read off at another layout's knots."""

    def at(knots: Array, old_knots: Array, values: Array) -> Array:
        return np.interp(knots, old_knots, values)

    h_on = at(new.temperature_c, old.temperature_c, t.h_on)
    h_off = at(new.temperature_c, old.temperature_c, t.h_off)
    f = at(new.current_a, old.current_a, t.f)
    reference = h_on[new.reference]
    return replace(
        t,
        f=f * reference,
        g=at(new.velocity_m_s, old.velocity_m_s, t.g),
        h_on=h_on / reference,
        h_off=h_off / h_off[new.reference],
    )


def _searched_filter(fit: JointFit, order: int) -> Array:
    """The filter that suits the tables as they are."""
    model = fit.model
    factors = [model.factor(r) for r in model.records]
    static = [
        base.averaged(r.as_stored(base.backbone(x, fit.tables).force_n), k)
        for r, x, k in zip(model.records, model.inputs, factors, strict=True)
    ]
    force = [base.averaged(r.force_n, k) for r, k in zip(model.records, factors, strict=True)]
    rates = [r.rate_hz / k for r, k in zip(model.records, factors, strict=True)]
    return search_filter(order, rates, static, force, model.weights)


def few(records: Sequence[Record]) -> list[Record]:
    """A few records that span the campaign's currents and temperatures: enough to start with."""
    if len(records) <= START_RECORDS:
        return list(records)
    order = sorted(
        records, key=lambda r: (round(float(r.current_a.mean()), 1), float(r.temperature_c.mean()))
    )
    return [order[int(k)] for k in np.linspace(0, len(order) - 1, START_RECORDS)]
