"""Adds named effects to a damper's model, proves them on runs left out, and makes it a damper that runs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.evidence import Evidence
from mrctl.discover.grow import grown_by
from mrctl.discover.refit import error_on, fitted, one_more, scatters, split, thinned
from mrctl.discover.unseen import Unseen
from mrctl.identify.finish import damper_of, table_std
from mrctl.identify.joint_fit import JointFit
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper
from mrctl.model.effects.base import Effect, Vector

Array = NDArray[np.float64]
Report = Callable[[float, str], None]

WORSE = 1.02  # times the error on the runs left out: less is the same, which few runs cannot tell


@dataclass(frozen=True, eq=False)
class Extension:
    """A model with effects: fitted to all runs, with its error on runs that another fit did not see."""

    effects: tuple[str, ...]
    base: JointFit  # the model without the added effects, fitted to all runs
    fit: JointFit
    damper: Damper
    std: dict[str, tuple[float, ...]]
    steps: tuple[tuple[tuple[str, ...], float], ...]  # effects, and the held-out error in N with them
    held_out: tuple[str, ...]
    noise_floor_n: float | None
    refused: tuple[str, ...] = ()  # effects with which runs or motions left out were predicted worse

    @property
    def rmse_before_n(self) -> float:
        """Held out, without the new effects."""
        return self.steps[0][1]

    @property
    def rmse_after_n(self) -> float:
        """Held out, with them."""
        return self.steps[-1][1]


def extend(
    campaign: Campaign,
    known: Sequence[Effect],
    added: Sequence[Effect],
    values: Mapping[str, Vector] | None = None,
    free: Mapping[str, Sequence[bool]] | None = None,
    report: Report = lambda _share, _what: None,
    evidence: Evidence | None = None,
    *,
    falling: bool = False,
    unseen: Collection[str] = (),
) -> Extension:
    """Fit base, known and added effects; the error before and after each on runs left out, as measured.

    values: where effects begin, SI. evidence: the campaign as a diagnosis with these effects left it; without
    one it is made here. falling: leave away those with which the error on the runs left out rises; unseen: of
    these names also those with which that on motions left out does, as must be asked of effects that are only
    a part of the truth, or one of several.

    Raises InputError for a campaign without a usable run, ValueError where the filter found cannot be carried
    to the loop's rates.
    """
    given = dict(values or {})
    measured = Evidence.of(campaign)
    records = thinned((evidence or _ready(measured, (*known, *added), given)).full)
    parts = split(campaign, thinned(measured.full), records)
    report(0.0, ", ".join(e.name for e in known) or "base model")
    first = fit = fitted(
        parts.training, known, {e.name: given.get(e.name, e.typical) for e in known}, free=free
    )
    steps = [(_names(known), error_on(first, parts.held_out, parts.begins))]
    chosen, refused = tuple(known), []
    motions = Unseen.of(records, thinned(measured.full), known, given, free) if unseen and added else None
    for count, effect in enumerate(added, 1):
        report(count / (len(added) + 2), ", ".join(_names((*chosen, effect))))
        more = one_more(fit, parts.training, (*chosen, effect), given, free)
        apart = scatters(more)
        errors = [error_on(f, parts.held_out, parts.begins, scaled=apart) for f in (fit, more)]
        if falling and errors[1] > WORSE * errors[0]:
            refused.append(effect.name)
            continue
        if motions is not None:
            after = motions.with_one_more((*chosen, effect), given, free)
            if effect.name in unseen and not after.foretells_better_than(motions):
                refused.append(effect.name)
                continue
            motions = after
        chosen, fit = (*chosen, effect), more
        steps.append((_names(chosen), error_on(more, parts.held_out, parts.begins)))
    report((len(added) + 1) / (len(added) + 2), "all runs")
    whole = fitted(records, chosen, dict(fit.effect_values), start=fit, free=free)
    std = table_std(whole, whole.covariance())
    plain = fitted(records, known, given, start=first) if len(chosen) > len(known) else whole
    return Extension(
        _names(chosen),
        plain,
        whole,
        damper_of(whole),
        std,
        tuple(steps),
        parts.names,
        parts.noise_floor_n,
        tuple(refused),
    )


def _names(chosen: Sequence[Effect]) -> tuple[str, ...]:
    return tuple(e.name for e in chosen)


def _ready(evidence: Evidence, chosen: Sequence[Effect], values: Mapping[str, Vector]) -> Evidence:
    """The campaign without the noise of its motion, its steps timed, as a model with all effects sees it."""
    base = evidence.base()
    fit = base.fit
    for effect in chosen:
        fit = grown_by(fit, effect, values.get(effect.name))
    evidence = evidence.steadied(fit).zeroed(fit).synchronised(fit)
    return evidence.timed(evidence.stepless(fit))
