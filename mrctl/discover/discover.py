"""The whole loop: identify, diagnose, extend, until nothing more can honestly be added."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mrctl.discover.diagnose import Diagnosis, diagnose
from mrctl.discover.extend import Extension, extend
from mrctl.discover.unseen import motion_parts
from mrctl.measurements.run import Campaign
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
    part_only = found.verdict == "unexplained"
    known = effects()
    moves = motion_parts(found.evidence.measured) is not None
    taken = [one for one in found.found if part_only or moves or not one.rivals]
    places = {one.trial.effect.name: one for one in taken}
    rivals = {name: [known[r.name] for r in one.rivals] for name, one in places.items()}
    others = {name: one.others if part_only else rivals[name] for name, one in places.items()}
    others = {name: [o for o in some if o.name not in places] for name, some in others.items()}
    doubted = {name for name in places if part_only or rivals[name]}
    fit = found.final.fit
    values = {one.trial.effect.name: fit.effect_values[one.trial.effect.name] for one in taken}
    free = {one.trial.effect.name: one.trial.look.free.tolist() for one in taken}
    extension = extend(
        campaign,
        (),
        [one.trial.effect for one in taken],
        values,
        free,
        lambda share, what: report(0.6 + 0.4 * share, what),
        found.evidence,
        falling=True,
        unseen=doubted,
        instead=others,
        begin=fit,
    )
    verdict = "none" if found.verdict == "found" else found.verdict
    if extension.refused and verdict == "none":
        verdict = "unexplained"
    words = {
        "none": "Nothing is left that this campaign can show.",
        "ambiguous": "What is left could be one of several effects; see the next run.",
        "unexplained": "What is left is explained by no known effect.",
    }[verdict]
    for name, own in others.items() if verdict == "ambiguous" else []:
        alike = [name, *(other.name for other in own)]
        added = next((one for one in alike if one in extension.effects), None)
        if own and added is not None:
            rest = " or ".join(one for one in alike if one != added)
            words += f" {added} is added, which foretells best what is left out; it may be {rest}."
    if extension.refused:
        names = ", ".join(extension.refused)
        words += f" Not added, since runs or motions that were left out are predicted worse with it: {names}."
    return Discovery(found, extension, verdict, words)
