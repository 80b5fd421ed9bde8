"""Adds named effects to a damper's model, proves them on runs left out, and makes it a damper that runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.evidence import Evidence
from mrctl.discover.grow import grown_by
from mrctl.discover.refit import Split, error_on, fitted, split, thinned
from mrctl.identify.finish import damper_of, table_std
from mrctl.identify.joint_fit import JointFit
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper
from mrctl.model.effects.base import Effect, Vector

Array = NDArray[np.float64]
Report = Callable[[float, str], None]


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
) -> Extension:
    """Fit base, known and added effects; the error before and after each on runs left out, as measured.

    values: where effects begin, SI. evidence: the campaign as a diagnosis with these effects left it; without
    one it is made here. Raises InputError for a campaign without a usable run, ValueError where the filter
    found cannot be carried to the loop's rates.
    """
    given = dict(values or {})
    measured = Evidence.of(campaign)
    records = thinned((evidence or _ready(measured, (*known, *added), given)).full)
    parts = split(campaign, thinned(measured.full), records)
    steps = []
    fit: JointFit | None = None
    first: JointFit | None = None
    for count in range(len(added) + 1):
        chosen = (*known, *added[:count])
        report(count / (len(added) + 2), ", ".join(e.name for e in chosen) or "base model")
        fit = _proven(parts, chosen, given, free, fit)
        first = first or fit
        steps.append((tuple(e.name for e in chosen), error_on(fit, parts.held_out)))
    report((len(added) + 1) / (len(added) + 2), "all runs")
    whole = fitted(records, (*known, *added), dict(fit.effect_values) if fit else given, start=fit, free=free)
    std = table_std(whole, whole.covariance())
    plain = fitted(records, known, given, start=first) if added else whole
    return Extension(
        tuple(e.name for e in (*known, *added)),
        plain,
        whole,
        damper_of(whole),
        std,
        tuple(steps),
        parts.names,
        parts.noise_floor_n,
    )


def _ready(evidence: Evidence, chosen: Sequence[Effect], values: Mapping[str, Vector]) -> Evidence:
    """The campaign without the noise of its motion, its steps timed, as a model with all effects sees it."""
    base = evidence.base()
    fit = base.fit
    for effect in chosen:
        fit = grown_by(fit, effect, values.get(effect.name))
    evidence = evidence.steadied(fit)
    return evidence.timed(fit)


def _proven(
    parts: Split,
    chosen: Sequence[Effect],
    values: Mapping[str, Vector],
    free: Mapping[str, Sequence[bool]] | None,
    before: JointFit | None,
) -> JointFit:
    """The fit of the training records, begun where the smaller model's stood and at the given values."""
    if before is None:
        return fitted(
            parts.training, chosen, {e.name: values.get(e.name, e.typical) for e in chosen}, free=free
        )
    begin = grown_by(before, chosen[-1], values.get(chosen[-1].name))
    return fitted(parts.training, chosen, begin.effect_values, start=begin, free=free)
