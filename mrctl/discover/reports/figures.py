"""A diagnosis as JSON-ready figures, and in words."""

from __future__ import annotations

from typing import Any

from mrctl.discover.diagnose import Diagnosis
from mrctl.discover.noise.lines import Line
from mrctl.discover.reports.channels import channel_figures, channel_words
from mrctl.discover.reports.fitted import derived_of, parameters_of, root
from mrctl.discover.reports.ranking import ranking_of, removed_percent
from mrctl.discover.verdict.balance import STRANGE
from mrctl.discover.verdict.courses import Course

MOST_COURSES = 3


def diagnosis_figures(d: Diagnosis) -> dict[str, Any]:
    """All that `mrctl diagnose --json` writes."""
    return {
        "verdict": d.verdict,
        "effects": list(d.effects),
        "words": verdict_words(d),
        "rmse_n": d.rmse_n(d.base.held_out_mean_square),
        "rmse_after_n": d.rmse_n(d.final.held_out_mean_square),
        "noise_floor_n": root(d.balance.noise) if d.balance.measured else None,
        "noise_estimate_n": root(d.balance.noise),
        "removable_n": root(d.removable),
        "left_n": root(d.balance.left),
        "explained_percent": explained_percent(d),
        "ranking": ranking_of(d),
        "found": [
            {
                "effect": f.trial.effect.name,
                "parameters": parameters_of(d.final.fit, f.trial.effect.name),
                "derived": derived_of(d.final.fit, f.trial.effect.name),
                "rivals": [{"effect": r.name, "why": r.why} for r in f.rivals],
            }
            for f in d.found
        ],
        "structure": {
            "explained_percent_of_residual": 100.0 * d.left.share if d.left.significant else 0.0,
            "where": [
                {"signals": list(m.signals), "explained_n": root(m.explained_n2)}
                for m in d.left.maps[:3]
                if m.explained_n2 > 0.0
            ],
            "courses": [
                {
                    "force": c.words,
                    "explained_percent": 100.0 * c.share,
                    "by_chance": c.chance,
                    "measure": c.measure,
                }
                for c in courses_told(d)
            ],
            "bursts_n": root(d.balance.bursts),
            "by_run_n": root(d.balance.by_run),
            "swelling_n": root(d.balance.swelling),
            "alike_n": root(d.balance.alike),
            "line": None if d.balance.line is None else _stated(d.balance.line),
            "hum": [_stated(hum) for hum in d.balance.hums],
        },
        "channels": channel_figures(d),
        "not_constant": [
            {"effect": c.effect, "signal": c.signal, "where_high": c.where_high, "error": c.error}
            for c in d.changes
        ],
        "cannot_reveal": d.hidden,
        "next_run": None if d.next_run is None else d.next_run.figures(),
        "seconds": d.seconds,
    }


def courses_told(d: Diagnosis) -> list[Course]:
    """Courses of what the base leaves that matter and are no chance; the one in an effect's place first."""
    if d.verdict != "unexplained":
        return []
    told = [c for c in d.courses if c.certain and c.share > STRANGE and c is not d.stranger]
    return [*([d.stranger] if d.stranger else []), *told][:MOST_COURSES]


def _stated(line: Line) -> dict[str, float]:
    return {"frequency_hz": line.frequency_hz, "rms_n": root(line.mean_square_n2)}


def explained_percent(d: Diagnosis) -> float:
    """What the effects found take off, of what can be removed."""
    return removed_percent(d, d.base, d.final)


def verdict_words(d: Diagnosis) -> str:
    """The verdict in a sentence or two."""
    before, after = (d.rmse_n(proof.held_out_mean_square) for proof in (d.base, d.final))
    floor = f" The noise is {root(d.balance.noise):.3g} N ({d.balance.how})."
    if d.balance.hums:
        at = ", ".join(f"{h.frequency_hz:.0f}" for h in d.balance.hums)
        hum = root(sum(h.mean_square_n2 for h in d.balance.hums))
        floor += f" {hum:.3g} N of it hum at {at} Hz, alike in all runs."
    floor += channel_words(d)
    names = ", ".join(d.effects)
    if d.verdict == "none":
        return f"Nothing is missing that this campaign can show: {before:.3g} N held out.{floor}"
    changing = "".join(f" {c.words}: it is not what is missing." for c in d.changes)
    if d.verdict == "found":
        those = "it" if len(d.effects) == 1 else "them"
        fall = f"With {those} the held-out error falls from {before:.3g} to {after:.3g} N."
        left = root(d.balance.left)
        more = f" {left:.3g} N are left over the noise, which no effect explains." if left else ""
        return f"Missing: {names}. {fall}{more}{changing}{floor}"
    if d.verdict == "ambiguous":
        why = "; ".join(dict.fromkeys(f"{r.name}: {r.why}" for f in d.found for r in f.rivals))
        return f"One of {names} is missing, and this campaign cannot tell which ({why}).{changing}{floor}"
    left = root(max(d.removable, d.balance.bursts))
    missing = f"Something is missing that no known effect explains: {left:.3g} N."
    return f"{missing}{_nearest_words(d)}{changing}{_where_words(d)}{floor}"


def _where_words(d: Diagnosis) -> str:
    """Where what no effect explains shows itself."""
    where = ", ".join(" and ".join(m.signals) for m in d.left.maps[:2] if m.explained_n2 > 0.0)
    where = f" It shows over {where}." if where else ""
    if d.balance.line is not None:
        line = d.balance.line
        where += f" {root(line.mean_square_n2):.3g} N of it is a line at {line.frequency_hz:.0f} Hz."
    where += "".join(
        f" A force that {c.words} would take {100.0 * c.share:.0f} % of what the base leaves"
        f" (to see it by itself: {c.measure})."
        for c in courses_told(d)[:1]
    )
    if d.balance.bursts:
        where += f" {root(d.balance.bursts):.3g} N of it comes in bursts: is it the load cell or its cable?"
    if d.balance.swelling:
        where += (
            f" {root(d.balance.swelling):.3g} N does not repeat from cycle to cycle and comes with the force:"
            " is the current what it is told to be?"
        )
    if d.balance.alike:
        where += f" {root(d.balance.alike):.3g} N of it is alike in runs of one motion, as no noise is."
    if d.balance.by_run:
        own = root(d.balance.by_run)
        where += f" {own:.3g} N of it is another zero of the force in each run: does the load cell drift?"
    return where


def _nearest_words(d: Diagnosis) -> str:
    """How near the effects come that help, though none is what is missing."""
    if not d.found:
        return ""
    helps = ", ".join(f.trial.effect.name for f in d.found)
    share = explained_percent(d)
    if d.stranger is not None:
        return f" It is not {helps}, which would explain {share:.0f} %: a course fits better."
    if d.balance.cleared:
        return f" The nearest ({helps}) explains it where it was fitted, but does not foretell the rest."
    return f" The nearest ({helps}) explains {share:.0f} % of it only."
