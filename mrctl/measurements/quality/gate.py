"""All checks in the order in which one defect would otherwise hide behind another."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from mrctl.errors import InputError, Problem
from mrctl.measurements.quality.clock import check_clock, check_motion
from mrctl.measurements.quality.delay import check_delay, common_delay
from mrctl.measurements.quality.finding import Finding, warning
from mrctl.measurements.quality.physics import check_consistency, check_sign
from mrctl.measurements.quality.sensors import check_clipping, check_stuck
from mrctl.measurements.quality.spikes import check_spikes
from mrctl.measurements.quality.units import check_units
from mrctl.measurements.run import Campaign, Run


def check_run(run: Run) -> list[Finding]:
    """Everything that looks wrong with a run, errors first; empty for a sound one.

    A defect is said once: after a broken clock nothing else is judged, and a channel in a wrong unit is not
    compared with others.
    """
    findings = _check(run)
    if not any(finding.level == "error" for finding in findings):
        findings += check_delay(run)
    return findings


def check_campaign(campaign: Campaign) -> list[Finding]:
    """The findings of all runs, and those that only a whole campaign shows; errors first."""
    runs = campaign.runs
    strongest_n = max((float(np.max(np.abs(run.force_n))) for run in runs if run.has_force), default=0.0)
    findings = [finding for run in runs for finding in _check(run, strongest_n)]
    findings += _twins(runs)
    if not any(finding.level == "error" for finding in findings):
        common = common_delay(runs)
        late = [finding for run in runs for finding in check_delay(run)] if common is None else []
        more = f" (and so in {len(late) - 1} more runs)" if len(late) > 1 else ""
        findings += [replace(finding, what=finding.what + more) for finding in late[:1]]
        findings += common or []
    return _errors_first(findings)


def _check(run: Run, strongest_n: float = 0.0) -> list[Finding]:
    """All but the delay, which a campaign may know better than a run; strongest_n: its largest force."""
    findings = list(check_clock(run))
    if findings:
        return findings
    units = dict(check_units(run, strongest_n))
    findings += units.values()
    wrong = {attribute for attribute, finding in units.items() if finding.level == "error"}
    moving = not wrong & {"time_s", "velocity_m_s"}
    if moving:
        motion = list(check_motion(run))
        findings += motion
        if any(finding.level == "error" for finding in motion):
            return _errors_first(findings)
    findings += check_clipping(run)
    findings += check_stuck(run)
    findings += check_spikes(run)
    if moving and "force_n" not in wrong:
        findings += check_sign(run)
    if moving and "displacement_m" not in wrong:
        findings += check_consistency(run)
    return _errors_first(findings)


def require_sound(campaign: Campaign) -> list[Problem]:
    """Warnings to print, of loading and of the gate; InputError with all errors if there are any."""
    findings = check_campaign(campaign)
    errors = [finding.problem for finding in findings if finding.level == "error"]
    if errors:
        raise InputError(errors)
    return [*campaign.warnings, *(finding.problem for finding in findings)]


def _twins(runs: Iterable[Run]) -> list[Finding]:
    """Runs with the same numbers: held-out errors would be none."""
    seen: dict[bytes, Run] = {}
    findings = []
    for run in runs:
        key = hashlib.sha256(run.velocity_m_s.tobytes() + run.force_n.tobytes()).digest()
        if key in seen:
            what = f"the same measurement as {seen[key].name}"
            findings.append(
                warning(run, None, what, "remove one: it would count twice, and be its own proof")
            )
        seen.setdefault(key, run)
    return findings


def _errors_first(findings: list[Finding]) -> list[Finding]:
    return sorted(findings, key=lambda finding: finding.level != "error")
