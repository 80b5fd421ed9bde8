"""The whole loop: identify, diagnose, extend, until nothing more can honestly be added."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mrctl.discover.diagnose import Diagnosis, diagnose
from mrctl.discover.extend import Extension, extend
from mrctl.discover.fits.unseen import motion_parts
from mrctl.discover.verdict.judged import Found, judged_by
from mrctl.measurements.run import Campaign
from mrctl.model.effects.base import Effect
from mrctl.model.effects.registry import effects

Report = Callable[[float, str], None]


@dataclass(frozen=True, eq=False)
class Discovery:
    """What was missing, the model with it, and the verdict on what is left."""

    diagnosis: Diagnosis
    extension: Extension
    verdict: str
    words: str


def discover(campaign: Campaign, report: Report = lambda _share, _what: None) -> Discovery:
    """Find the effects that this data bears out, add them one by one, and say what remains.

    Of effects that this campaign cannot tell apart the one that foretells best what is left out is added, if
    any does; which it is, the next run decides. So it is with those that explain a part only, and the rest
    is called unexplained. A campaign of too few motions adds no effect that has rivals.
    """
    found = diagnose(campaign, report=lambda share, what: report(0.6 * share, what))
    extension = extension_of(campaign, found, lambda share, what: report(0.6 + 0.4 * share, what))
    verdict = found.verdict
    if verdict == "found":
        # Of what is left beside it, which may be more than noise.
        verdict = judged_by(found.evidence, found.final, found.final, []).verdict
    if extension.refused and verdict == "none":
        verdict = "unexplained"
    return Discovery(found, extension, verdict, _words(found, extension, verdict))


def extension_of(
    campaign: Campaign, found: Diagnosis, report: Report = lambda _share, _what: None
) -> Extension:
    """What a diagnosis found, added to the model that it found it with, one by one, and proven.

    Raises what `extend` raises.
    """
    taken = _taken(found)
    chosen = [one.trial.effect for one in taken]
    fit = found.final.fit
    extension = extend(
        campaign,
        (),
        chosen,
        {effect.name: fit.effect_values[effect.name] for effect in chosen},
        {one.trial.effect.name: one.trial.look.free.tolist() for one in taken},
        report,
        found.evidence,
        falling=True,
        unseen={one.trial.effect.name for one in taken if found.verdict == "unexplained" or one.rivals},
        instead=_others(found, taken),
        begin=fit,
    )
    if found.verdict != "found" or not (extension.refused or _warmth_in_runs(found)):
        return extension
    # What each run says of itself fits well and may foretell nothing: once more without all that.
    so_far = (len(chosen) + 1) / (len(chosen) + 2)
    anew = extend(
        campaign,
        (),
        chosen,
        report=lambda share, what: report(so_far + (1.0 - so_far) * share, what),
        falling=True,
    )
    return min(extension, anew, key=lambda one: (len(one.refused), one.rmse_after_n))


def _warmth_in_runs(found: Diagnosis) -> bool:
    """Whether runs have scales or warmths of their own beside a fluid that warms up."""
    own = found.evidence.cell.gains.any() or any(r.warmer_k for r in found.evidence.measured)
    return bool(own and found.final.fit.model.effects.warm)


def _taken(found: Diagnosis) -> list[Found]:
    """The effects to add; without enough motions to decide by, none that has rivals."""
    if found.verdict == "unexplained" or motion_parts(found.evidence.measured) is not None:
        return found.found
    return [one for one in found.found if not one.rivals]


def _others(found: Diagnosis, taken: Sequence[Found]) -> dict[str, list[Effect]]:
    """By the name of an effect to add, those that may stand in its place."""
    known, names = effects(), {one.trial.effect.name for one in taken}
    places = {}
    for one in taken:
        rivals = [known[r.name] for r in one.rivals]
        others = one.others if found.verdict == "unexplained" else rivals
        places[one.trial.effect.name] = [o for o in others if o.name not in names]
    return places


def _words(found: Diagnosis, extension: Extension, verdict: str) -> str:
    """What remains, in a sentence or two."""
    words = {
        "none": "Nothing is left that this campaign can show.",
        "ambiguous": "What is left could be one of several effects; see the next run.",
        "unexplained": "What is left is explained by no known effect.",
    }[verdict]
    places = _others(found, _taken(found)) if verdict == "ambiguous" else {}
    for name, own in places.items():
        alike = [name, *(other.name for other in own)]
        added = next((one for one in alike if one in extension.effects), None)
        if own and added is not None:
            rest = " or ".join(one for one in alike if one != added)
            words += f" {added} is added, which foretells best what is left out; it may be {rest}."
    if extension.refused:
        names = ", ".join(extension.refused)
        words += f" Not added, since runs or motions that were left out are predicted worse with it: {names}."
    return words
