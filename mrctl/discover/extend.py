"""Adds named effects to a damper's model, proves them on runs left out, and makes it a damper that runs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.evidence import Evidence
from mrctl.discover.grow import grown_by
from mrctl.discover.refit import Split, error_on, fitted, one_more, scatters, split, thinned
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
    instead: Mapping[str, Sequence[Effect]] | None = None,
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
    known, added = measured.sized(known), measured.sized(added)
    others = {name: measured.sized(own) for name, own in (instead or {}).items()}
    records = thinned((evidence or _ready(measured, (*known, *added), given)).full)
    parts = split(campaign, thinned(measured.full), records)
    report(0.0, ", ".join(e.name for e in known) or "base model")
    first = fitted(parts.training, known, {e.name: given.get(e.name, e.typical) for e in known}, free=free)
    motions = Unseen.of(records, thinned(measured.full), known, given, free) if unseen and added else None
    here = before = _Model(tuple(known), first, parts, motions, given, free)
    steps, refused = [(_names(known), here.error_n)], []
    for count, effect in enumerate(added, 1):
        better: _Model | None = None
        for one in (effect, *others.get(effect.name, ())):
            if one.name in _names(here.chosen):
                continue
            report(count / (len(added) + 2), ", ".join(_names((*here.chosen, one))))
            more = here.with_one_more(one)
            if falling and not more.bears_out(here, told=one.name in unseen):
                continue
            if better is None or more.foretells_better_than(better):
                better = more
        if better is None:
            refused.append(effect.name)
            continue
        here = better
        steps.append((_names(here.chosen), here.error_n))
    report((len(added) + 1) / (len(added) + 2), "all runs")
    whole = fitted(records, here.chosen, dict(here.fit.effect_values), start=here.fit, free=free)
    std = table_std(whole, whole.covariance())
    plain = whole if here is before else fitted(records, known, given, start=first)
    return Extension(
        _names(here.chosen),
        plain,
        whole,
        damper_of(whole),
        std,
        tuple(steps),
        parts.names,
        parts.noise_floor_n,
        tuple(refused),
    )


@dataclass(frozen=True, eq=False)
class _Model:
    """A model fitted without the runs left out, and without each of the motions if they are asked."""

    chosen: tuple[Effect, ...]
    fit: JointFit
    parts: Split
    motions: Unseen | None
    values: Mapping[str, Vector]
    free: Mapping[str, Sequence[bool]] | None

    @cached_property
    def error_n(self) -> float:
        """On the runs left out."""
        return error_on(self.fit, self.parts.held_out, self.parts.begins)

    def with_one_more(self, effect: Effect) -> _Model:
        """The same with one more effect."""
        chosen = (*self.chosen, effect)
        fit = one_more(self.fit, self.parts.training, chosen, self.values, self.free)
        motions = self.motions and self.motions.with_one_more(chosen, self.values, self.free)
        return replace(self, chosen=chosen, fit=fit, motions=motions)

    def bears_out(self, before: _Model, *, told: bool) -> bool:
        """Whether the runs left out bear its last effect out; told: and motions left out, where asked."""
        apart = scatters(self.fit)
        errors = [
            error_on(one.fit, self.parts.held_out, self.parts.begins, scaled=True) if apart else one.error_n
            for one in (before, self)
        ]
        if errors[1] > WORSE * errors[0]:
            return False
        return not told or self.foretells_better_than(before) is not False

    def foretells_better_than(self, other: _Model) -> bool | None:
        """Whether it predicts motions left out better; None where none were left out."""
        if self.motions is None or other.motions is None:
            return None
        return self.motions.foretells_better_than(other.motions)


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
