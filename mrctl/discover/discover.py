"""The whole loop: identify, diagnose, extend, until nothing more can honestly be added."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mrctl.discover.diagnose import Diagnosis, diagnose
from mrctl.discover.extend import Extension, extend
from mrctl.measurements.run import Campaign

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

    An effect that this campaign cannot tell from another is not added: the next run decides. Those that
    explain a part only are added, the best of rivals, if they help to predict runs and motions left out, and
    the rest is called unexplained.
    """
    found = diagnose(campaign, report=lambda share, what: report(0.6 * share, what))
    part_only = found.verdict == "unexplained"
    sure = [one for one in found.found if part_only or not one.rivals]
    fit = found.final.fit
    values = {one.trial.effect.name: fit.effect_values[one.trial.effect.name] for one in sure}
    free = {one.trial.effect.name: one.trial.look.free.tolist() for one in sure}
    extension = extend(
        campaign,
        (),
        [one.trial.effect for one in sure],
        values,
        free,
        lambda share, what: report(0.6 + 0.4 * share, what),
        found.evidence,
        falling=True,
        unseen=part_only,
    )
    verdict = "none" if found.verdict == "found" else found.verdict
    if extension.refused and verdict == "none":
        verdict = "unexplained"
    words = {
        "none": "Nothing is left that this campaign can show.",
        "ambiguous": "What is left could be one of several effects; see the next run.",
        "unexplained": "What is left is explained by no known effect.",
    }[verdict]
    if extension.refused:
        names = ", ".join(extension.refused)
        words += f" Not added, since runs or motions that were left out are predicted worse with it: {names}."
    return Discovery(found, extension, verdict, words)
