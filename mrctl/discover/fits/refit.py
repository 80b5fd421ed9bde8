"""From a searched model to one that can be written down: fitted to all data, and proven on runs left out."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.folds import as_warm, covered, held_as_long
from mrctl.discover.fits.grow import grown_by, grown_by_each
from mrctl.discover.fits.settle import WORTH_FREEING
from mrctl.discover.fits.trusting import as_plain
from mrctl.discover.noise.noise_floor import noise_floor, pooled_floor
from mrctl.identify.best import fit_base, moved
from mrctl.identify.effects_fit import Effects
from mrctl.identify.finish import at_full_shape, full_shape
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.pasts import with_pasts
from mrctl.identify.penalties import weighed_as
from mrctl.identify.plain_lags import free_to_be_late
from mrctl.identify.records import Record, possible_rise_k
from mrctl.identify.run_scatter import ScatteredModel
from mrctl.identify.start import as_warm_as_measured
from mrctl.measurements.run import Campaign
from mrctl.model.effects.base import Effect, Stage, Vector

Array = NDArray[np.float64]
Spare = Callable[[Record, Sequence[Record]], bool]

FITTED_HZ = 1000.0  # records that are faster are averaged
GAUGED = 3  # times that the largest |g| may move to another knot
ROUNDING = 1e-6
HELD_OUT_SHARE = 4  # one run of so many is left out, or the last such part of each run


@dataclass(frozen=True, eq=False)
class Split:
    """Records to fit and records to be proven on, each from a sample on, and what the latter are called."""

    training: list[Record]
    held_out: list[Record]
    begins: list[int]
    names: tuple[str, ...]
    noise_floor_n: float | None


def thinned(records: Sequence[Record]) -> list[Record]:
    """The records at a rate that fits need."""
    return [r.decimated(max(r.slow, int(r.rate_hz / FITTED_HZ))) for r in records]


def split(campaign: Campaign, records: Sequence[Record], ready: Sequence[Record] | None = None) -> Split:
    """Every fourth run whose conditions others cover; where there is none, the last quarter of every run.

    records: as they were measured, of which the held-out ones are. ready: the same for the fit, without what
    is known to be the motion's noise or the sampling of a step. What came before a run no model foretells: it
    is taken as the run itself tells it there, held out or not.
    """
    ready = records if ready is None else ready
    both = zip(records, ready, strict=True)
    records = [replace(r, before_a=told.before_a, warmer_k=told.warmer_k) for r, told in both]
    # A steady current that the rest has in passing only is told there less well than where it is held; what
    # warmth does to a field, not at all by runs that have none.
    asked: list[Spare] = [covered]
    chosen = _spread(records, asked)
    for also in (held_as_long, as_warm):
        better = _spread(records, [*asked, also])
        if 2 * len(better) >= len(chosen):
            chosen, asked = better, [*asked, also]
    if chosen:
        held = [records[n] for n in chosen]
        runs = [campaign.runs[r.run] for r in held]
        floor = pooled_floor([noise_floor(run) for run in runs], [len(run) for run in runs])
        rest = [r for n, r in enumerate(ready) if n not in chosen]
        return Split(rest, held, [0] * len(held), tuple(run.name for run in runs), floor)
    runs = [campaign.runs[r.run] for r in records]
    floor = pooled_floor([noise_floor(run) for run in runs], [len(run) for run in runs])
    # Cut where a sample was measured.
    cut = [(len(r) - len(r) // HELD_OUT_SHARE) // r.finer * r.finer for r in records]
    return Split(
        [r.part(0, at) for r, at in zip(ready, cut, strict=True)],
        list(records),  # whole: what a part's start hangs on is before it
        cut,
        tuple(f"{run.name} (last quarter)" for run in runs),
        floor,
    )


def _spread(records: Sequence[Record], asked: Sequence[Spare]) -> list[int]:
    """Of the records that are spare beside all others, some far apart that are beside what they leave."""

    def spare(n: int, left: Container[int]) -> bool:
        rest = [o for m, o in enumerate(records) if m != n and m not in left]
        return all(one(records[n], rest) for one in asked)

    every = [n for n in range(len(records)) if spare(n, ())]
    chosen: list[int] = []
    for n in every[1 :: max(1, len(every) * HELD_OUT_SHARE // max(len(records), 1))]:
        if len(chosen) < max(1, len(records) // HELD_OUT_SHARE) and spare(n, chosen):
            chosen.append(n)
    return chosen


def fitted(
    records: Sequence[Record],
    chosen: Sequence[Effect],
    values: Mapping[str, Vector],
    *,
    start: JointFit | None = None,
    free: Mapping[str, Sequence[bool]] | None = None,
) -> JointFit:
    """Base and effects fitted jointly to records; `start`: a fit whose knots and tables to begin with.

    values: where the effects begin, SI; free: which of their parameters move (default: all not held).
    """
    # A fluid that heats itself leaves the temperatures at which the case was.
    warm = any(e.stage is Stage.TEMPERATURE for e in chosen)
    base = fit_base(records, warmer_k=possible_rise_k(records) if warm else 0.0) if start is None else start
    if not chosen and start is None:
        return base
    # What no run shows is not made up: without such an effect no fluid is warmer than its case.
    layout = base.model.layout if warm else as_warm_as_measured(base.model.layout, records)
    kind = ScatteredModel if chosen else JointModel
    model = kind(layout, records, Effects(tuple(chosen)), bool(chosen), base.model.slowest_pole)
    mask = model.free()
    if free is not None and chosen:
        own = [flag for e in chosen for flag in free.get(e.name, [not p.held for p in e.parameters])]
        mask[layout.size :] = own
    tables = base.tables if layout is base.model.layout else moved(base.tables, base.model.layout, layout)
    theta = model.pack(tables, values)
    model.reweigh(theta)
    penalties = weighed_as(base.penalties, model.penalties())
    fit = model.fit(theta, penalties=penalties, free=mask, rounds=3, iterations=12)
    late = fit if any(e.stage is Stage.OUTPUT for e in chosen) else _with_own_delay(fit, mask)
    return _levelled(_at_full_shape(late, mask))


def _levelled(fit: JointFit) -> JointFit:
    """The fit with f as all samples say it in the mean, where a run's own scale had no say in it."""
    if not scatters(fit):
        return fit
    old = fit.model
    plain = JointModel(old.layout, old.records, old.effects, old.minimum_phase, old.slowest_pole)
    plain.reweigh(fit.theta)
    free = np.zeros(plain.size, dtype=bool)
    free[plain.layout.parts["f"]] = True
    level = plain.fit(fit.theta, penalties=fit.penalties, free=free, rounds=1, iterations=12)
    return as_plain(fit, level.theta)


def _at_full_shape(fit: JointFit, free: NDArray[np.bool_]) -> JointFit:
    """The fit with g up to 1 where an effect's parameters hang on that, as a calibration has it."""
    for _ in range(GAUGED):
        if full_shape(fit.tables) < 1.0 + ROUNDING or not any(e.rescaled for e in fit.model.effects.chosen):
            break
        model = replace(
            fit.model, layout=replace(fit.model.layout, gauge=int(np.argmax(np.abs(fit.tables.g))))
        )
        model.weigh_as(fit.model)
        values = dict(zip(fit.effect_values, at_full_shape(fit), strict=True))
        penalties = weighed_as(fit.penalties, model.penalties())
        fit = model.fit(
            model.pack(fit.tables, values), penalties=penalties, free=free, rounds=1, iterations=12
        )
    return fit


def _with_own_delay(fit: JointFit, free: NDArray[np.bool_]) -> JointFit:
    """The fit with a filter that may be late by itself, as one with b0 = 0 is, where the data ask for it.

    A search holds the filter to lags, that a delay of the measurement be seen.
    """
    model = free_to_be_late(fit.model)
    late = model.fit(fit.theta, penalties=fit.penalties, free=free, rounds=1, iterations=12)
    if late.total > fit.total - WORTH_FREEING * model.layout.order:
        return fit
    return model.fit(late.theta, penalties=late.penalties, free=free, rounds=3, iterations=12)


def with_one_more(
    before: JointFit,
    records: Sequence[Record],
    effect: Effect,
    values: Vector | None = None,
    free: Mapping[str, Sequence[bool]] | None = None,
) -> JointFit:
    """The fit of the records with one more effect, begun at its values (SI) or where it takes most."""
    return _whole(grown_by(before, effect, values), records, free)


def with_one_of(
    before: JointFit,
    records: Sequence[Record],
    effects: Sequence[Effect],
    free: Mapping[str, Sequence[bool]] | None = None,
) -> list[JointFit]:
    """The fits of the records with one of several effects more, begun where each takes most."""
    return [_whole(one, records, free) for one in grown_by_each(before, effects)]


def _whole(begun: JointFit, records: Sequence[Record], free: Mapping[str, Sequence[bool]] | None) -> JointFit:
    return fitted(records, begun.model.effects.chosen, begun.effect_values, start=begun, free=free)


def error_on(
    fit: JointFit,
    records: Sequence[Record],
    begins: Sequence[int] | None = None,
    *,
    scaled: bool = False,
) -> float:
    """RMS error in N on other records, every sample measured; begins: from these samples on.

    What was before a record is what its first forces say (`with_pasts`).

    scaled: less what is in proportion to each record's force, which no model foretells of runs that scatter.
    """

    def forces_of(some: list[Record]) -> list[Array]:
        return fit.model.on(some).predict(fit.theta)

    told = with_pasts(records, forces_of)
    forces = forces_of([record for record, _ in told])
    left = []
    for record, (_, before), force, at in zip(
        records, told, forces, begins or [0] * len(records), strict=True
    ):
        made = force[before + at :: record.finer]
        error = record.force_n[at :: record.finer] - made
        left.append(error - made * float(made @ error) / float(made @ made) if scaled else error)
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2)))


def scatters(fit: JointFit) -> bool:
    """Whether the runs that it was fitted to differ in scale beyond chance."""
    return isinstance(fit.model, ScatteredModel) and fit.model.spread > 0.0
