"""Runs that the user keeps out of every fit, to see how well they are predicted."""

from __future__ import annotations

from dataclasses import replace
from fnmatch import fnmatch

from mrctl.errors import InputError
from mrctl.measurements.run import Campaign
from mrctl.printable import printable


def part(campaign: Campaign, pattern: str | None) -> tuple[Campaign, Campaign]:
    """The runs to fit and the runs to predict, those whose name a shell pattern fits; none without a pattern.

    Raises InputError where no run is left on one of the two sides, or none to predict has a force.
    """
    fits = [pattern is not None and fnmatch(r.name, printable(pattern)) for r in campaign.runs]
    out = tuple(r for r, fit in zip(campaign.runs, fits, strict=True) if fit)
    kept = tuple(r for r, fit in zip(campaign.runs, fits, strict=True) if not fit)
    if pattern is not None:
        where = f"--leave-out {pattern}"
        names = ", ".join(r.name for r in campaign.runs[:3])
        if not out:
            raise InputError.at(where, "no run has such a name", f"the runs are {names}, ...")
        if not kept:
            raise InputError.at(where, "every run has such a name: none is left to fit", "leave out fewer")
        silent = [r.name for r in out if not r.has_force]
        if silent:
            raise InputError.at(where, f"{silent[0]} has no force to compare with", "leave out others")
    return replace(campaign, runs=kept), replace(campaign, runs=out)
