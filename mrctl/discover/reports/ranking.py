"""The effects of a diagnosis in their order, each with the error once it is added, as JSON-ready figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mrctl.discover.diagnose import Diagnosis, real_alone
from mrctl.discover.fits.proof import Proof
from mrctl.discover.reports.fitted import derived_of, parameters_of
from mrctl.discover.search.levels import Trial
from mrctl.discover.verdict.judged import Found
from mrctl.identify.joint_fit import JointFit
from mrctl.model.effects.card import card


def ranking_of(d: Diagnosis) -> list[dict[str, Any]]:
    """What was found, step by step, and then the other effects that were fitted, each alone beside the base.

    An effect that was found comes beside those found before it (`beside`), with the parameters that it has
    in the final model, and the last of them with the final model's error: the error falls from entry to
    entry. One that has rivals is told as they are, from the round that it was fitted in with them.
    """
    found = [f.trial.effect.name for f in d.found]
    real = real_alone(d.first)
    entries, before = [], d.base
    for number, one in enumerate(d.found):
        proof = one.trial.proof if one.rivals else _with(d, found[: number + 1], one)
        entries.append(_entry(d, one.trial, before, proof, d.final.fit, found[:number], one))
        before = proof
    for trial in d.first.trials:
        if trial.effect.name not in found:
            significant = trial.effect.name in real
            entries.append(_entry(d, trial, d.base, trial.proof, trial.fit, significant=significant))
    return entries


def removed_percent(d: Diagnosis, before: Proof, after: Proof) -> float:
    """What a model takes off another one's mean square, of all that can be removed."""
    if d.removable <= 0.0:
        return 0.0
    return 100.0 * float(np.clip((before.mean_square - after.mean_square) / d.removable, 0.0, 1.0))


def _with(d: Diagnosis, names: Sequence[str], last: Found) -> Proof:
    """The model with these effects beside the base's own, as settled as the search came by it."""
    known = _effects(d.base)
    settled = [d.final, *(level.before for level in d.levels)]
    as_tried = [trial.proof for level in d.levels for trial in level.trials]
    wanted = known | set(names)
    return next((one for one in (*settled, *as_tried) if _effects(one) == wanted), last.trial.proof)


def _effects(proof: Proof) -> set[str]:
    return {e.name for e in proof.fit.model.effects.chosen}


def _entry(
    d: Diagnosis,
    trial: Trial,
    before: Proof,
    after: Proof,
    fit: JointFit,
    beside: Sequence[str] = (),
    found: Found | None = None,
    *,
    significant: bool = True,
) -> dict[str, Any]:
    return {
        "effect": trial.effect.name,
        "beside": list(beside),
        "rmse_n": d.rmse_n(after.held_out_mean_square),
        "removed_percent": removed_percent(d, before, after),
        "significant": significant,
        "rivals": [r.name for r in found.rivals] if found else [],
        "parameters": parameters_of(fit, trial.effect.name),
        "derived": derived_of(fit, trial.effect.name),
        "equation": card(trial.effect)["equation"],
        "chance": trial.chance,
    }
