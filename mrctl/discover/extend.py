"""Adds named effects to a damper's model, proves them on runs left out, and makes it a damper that runs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrctl.discover import taken_anew
from mrctl.discover.base_fit import fitted_to
from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.grow import grown_by
from mrctl.discover.fits.proof import Proof, prove
from mrctl.discover.fits.refit import (
    Split,
    error_on,
    fitted,
    scatters,
    split,
    thinned,
    with_one_more,
    with_one_of,
)
from mrctl.discover.fits.settle import WORTH_MOVING, settled
from mrctl.discover.fits.unseen import Unseen
from mrctl.discover.search.levels import search_level
from mrctl.discover.search.quiet import is_quiet
from mrctl.discover.verdict.worth import is_nothing
from mrctl.identify.finish import damper_of, table_std
from mrctl.identify.joint_fit import JointFit
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper
from mrctl.model.effects.base import Effect, Vector

Array = NDArray[np.float64]
Report = Callable[[float, str], None]

WORSE = 1.02  # times the error on the runs left out: less is the same, which few runs cannot tell
BORNE_OUT = 0.5  # of what it takes off runs fitted must an effect take off motions left out, in ratios


@dataclass(frozen=True, eq=False)
class Extension:
    """A model with effects: fitted to all runs, with its error on runs that another fit did not see."""

    effects: tuple[str, ...]
    base: JointFit  # the model as it was, without the added and with the removed effects, fitted to all runs
    fit: JointFit
    damper: Damper
    std: dict[str, tuple[float, ...]]
    steps: tuple[tuple[tuple[str, ...], float], ...]  # effects, and the held-out error in N with them
    held_out: tuple[str, ...]
    noise_floor_n: float | None
    refused: tuple[str, ...] = ()  # effects with which runs or motions left out were predicted worse

    @property
    def rmse_before_n(self) -> float:
        """Held out, with the effects that were there before."""
        return self.steps[0][1]

    @property
    def rmse_after_n(self) -> float:
        """Held out, with those that are in it now."""
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
    begin: JointFit | None = None,
    removed: Sequence[Effect] = (),
) -> Extension:
    """Fit base, known and added effects; the error before and after each on runs left out, as measured.

    removed: effects that were in the model beside the known ones: the first error is with them.
    values: where effects begin, SI. evidence: the campaign as a diagnosis with these effects left it;
    without one it is made here. falling: leave away those with which the error on the runs left out rises,
    beside the others that were added too, or that end as nothing; unseen: of these names also those with
    which that on motions left out does, as must be asked of effects that are only a part of the truth, or
    one of several. instead: by such an effect's name others that may stand in its place: of all of them, and
    of the places where fits of it may end, the best on runs and on motions left out is taken.
    begin: a model with effects that has been found; the fit with just those begins there too, since a base
    without them may lead it elsewhere.

    Raises InputError for a campaign without a usable run, ValueError where the filter found cannot be carried
    to the loop's rates.
    """
    given = dict(values or {})
    measured = Evidence.of(campaign)
    known, added, removed = (measured.sized(some) for some in (known, added, removed))
    were = (*known, *removed)
    others = {name: measured.sized(own) for name, own in (instead or {}).items()}
    if evidence is None:
        report(0.0, ", ".join(_names((*were, *added))) or "base model")
        evidence, found = _ready(measured, (*were, *added), given)
        begin = found if begin is None else begin
    records = thinned(evidence.full)
    parts = split(campaign, thinned(measured.full), records)
    begins = {e.name: given.get(e.name, e.typical) for e in were}
    report(0.0, ", ".join(_names(were)) or "base model")

    def motions(fit: JointFit) -> Unseen | None:
        return Unseen.of(fit, records, thinned(measured.full), free) if unseen else None

    here = was = _Model(were, fitted(parts.training, were, begins, free=free), parts, free, motions)
    if removed:
        here = _Model(tuple(known), fitted(parts.training, known, begins, free=free), parts, free, motions)
    steps = [(_names(one.chosen), one.error_n) for one in dict.fromkeys((was, here))]
    to_add, refused = list(added), list[Effect]()
    while to_add:
        effect = to_add.pop(0)
        if effect.name in _names(here.chosen):  # in another's place
            continue
        done = 1 + len(here.chosen) - len(known)
        report(done / (len(added) + 2), ", ".join(_names((*here.chosen, effect))))
        told = effect.name in unseen
        models = [here.with_one_more(effect, given.get(effect.name))]
        if told:  # from where a fit of it begins decides where it ends, as its rivals do
            rivals = [one for one in others.get(effect.name, ()) if one.name not in _names(here.chosen)]
            models += here.with_one_of((effect, *rivals))
        if begin is not None and not told:
            models += [one.begun_at(begin) for one in models if one.has_the_effects_of(begin)]
            models = [min(models, key=lambda one: one.fitted_n)]
        if falling:
            models = [one for one in models if one.holds_beside(here, told=told)]
        # Motions are left out last, which takes as many fits as there are parts of them.
        sound = (
            one
            for one in _best_first(_unlike(models))
            if not (falling and told) or one.foretells_better_than(here) is not False
        )
        better = next(sound, None)
        if better is None:
            refused.append(effect)
            continue
        here = better
        steps.append((_names(here.chosen), here.error_n))
        to_add, refused = [*to_add, *refused], []  # beside this one they may be borne out
    report((len(added) + 1) / (len(added) + 2), "all runs")
    whole = fitted(records, here.chosen, dict(here.fit.effect_values), start=here.fit, free=free)
    std = table_std(whole, whole.covariance())
    plain = whole if here is was else fitted(records, were, begins, start=was.fit)
    return Extension(
        _names(here.chosen),
        plain,
        whole,
        damper_of(whole),
        std,
        tuple(steps),
        parts.names,
        parts.noise_floor_n,
        _names(refused),
    )


@dataclass(frozen=True, eq=False)
class _Model:
    """A model fitted without the runs left out, and without each of the motions when they are asked."""

    chosen: tuple[Effect, ...]
    fit: JointFit
    parts: Split
    free: Mapping[str, Sequence[bool]] | None
    motions_of: Callable[[JointFit], Unseen | None]

    @cached_property
    def error_n(self) -> float:
        """On the runs left out."""
        return error_on(self.fit, self.parts.held_out, self.parts.begins)

    @cached_property
    def fitted_n(self) -> float:
        """On the runs that it was fitted to."""
        return error_on(self.fit, self.parts.training)

    @cached_property
    def motions(self) -> Unseen | None:
        """How motions left out are predicted; None where they are not asked."""
        return self.motions_of(self.fit)

    def with_one_more(self, effect: Effect, values: Vector | None) -> _Model:
        """The same with one more effect, begun at values or where a look finds most."""
        return self._with(with_one_more(self.fit, self.parts.training, effect, values, self.free))

    def with_one_of(self, effects: Sequence[Effect]) -> list[_Model]:
        """The same with one of several effects more, begun where each takes most."""
        return [self._with(fit) for fit in with_one_of(self.fit, self.parts.training, effects, self.free)]

    def _with(self, fit: JointFit) -> _Model:
        return _Model(fit.model.effects.chosen, fit, self.parts, self.free, self.motions_of)

    def has_the_effects_of(self, other: JointFit) -> bool:
        """Whether it has the same effects, in whatever order."""
        return {e.name for e in self.chosen} == {e.name for e in other.model.effects.chosen}

    def begun_at(self, other: JointFit) -> _Model:
        """The same effects, fitted from another fit with them."""
        fit = fitted(self.parts.training, self.chosen, other.effect_values, start=other, free=self.free)
        return _Model(self.chosen, fit, self.parts, self.free, self.motions_of)

    def holds_beside(self, before: _Model, *, told: bool) -> bool:
        """Whether there is any of its last effect and the runs left out bear it out.

        Where runs scatter in scale, but for what no model foretells of them; told: that too, as of a part of
        the truth: one that looks better in shape only is none to build on.
        """
        last = self.chosen[-1]
        if is_nothing(last, self.fit.effect_values[last.name]):
            return False
        errors = [[one.error_n for one in (before, self)]] if told or not scatters(self.fit) else []
        if scatters(self.fit):
            left = self.parts.held_out, self.parts.begins
            errors.append([error_on(one.fit, *left, scaled=True) for one in (before, self)])
        return all(now <= WORSE * was for was, now in errors)

    def foretells_better_than(self, other: _Model) -> bool | None:
        """Whether it predicts motions left out better, by a fair share of what it fits others better.

        By less, it describes the motions at hand only. None where none were left out.
        """
        if self.motions is None or other.motions is None:
            return None
        taken = other.motions.level - self.motions.level
        return taken > BORNE_OUT * max(float(np.log(other.fitted_n / self.fitted_n)), 0.0)


def _best_first(models: Sequence[_Model]) -> list[_Model]:
    """Models in the order in which they predict runs left out, and motions left out as much, where asked.

    In ratios: a tenth more of either counts alike. As measured, whatever the runs' own scales: it is the same
    runs for all, and the level counts.
    """

    def missed(one: _Model) -> float:
        beside = one.motions.level if one.motions is not None else 0.0
        return float(np.log(one.error_n)) + beside

    sound = [one for one in models if np.isfinite(one.error_n)]
    return sorted(sound, key=missed) if len(sound) > 1 else sound  # motions are only left out to choose


def _unlike(models: Sequence[_Model]) -> list[_Model]:
    """Those that have not ended where one before them has."""
    kept: list[_Model] = []
    for one in models:
        alike = (other for other in kept if one.has_the_effects_of(other.fit))
        if all(abs(one.fit.total - other.fit.total) > WORTH_MOVING for other in alike):
            kept.append(one)
    return kept


def _names(chosen: Sequence[Effect]) -> tuple[str, ...]:
    return tuple(e.name for e in chosen)


def _ready(
    evidence: Evidence, chosen: Sequence[Effect], values: Mapping[str, Vector]
) -> tuple[Evidence, JointFit | None]:
    """The campaign as a model with all effects sees it, and that model; None where there are none.

    Without the noise of its motion, its steps timed, and its runs begun from the currents and the warmths
    that such a model finds.
    """
    base = model = evidence.base()
    for effect in chosen:
        model = _grown(model, effect, values.get(effect.name), evidence)
    fit = model.fit
    evidence = evidence.steadied(fit).zeroed(fit).synchronised(fit)
    evidence = evidence.timed(evidence.stepless(fit))
    if not chosen:
        return evidence, None
    model = prove(fitted_to(evidence.records, fit), evidence.folds)
    evidence, model = taken_anew.remembered(evidence, model)
    evidence, model = taken_anew.begun_warm(evidence, model, base)
    return evidence, model.fit


def _grown(before: Proof, effect: Effect, values: Vector | None, evidence: Evidence) -> Proof:
    """The model with one more effect, begun at values or wherever a search for just this one ends best.

    No search is needed where one look leads to a model that leaves but white noise.
    """
    direct = prove(grown_by(before.fit, effect, values), evidence.folds)
    if values is not None or is_quiet(direct):
        return direct
    found = [t.proof for t in search_level(before, [effect], evidence.folds).trials]
    return settled(min((direct, *found), key=lambda one: one.mean_square), evidence.folds)
